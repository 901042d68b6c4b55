#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "scene/mesh_import.h"

namespace anchorsplat {

// Reads a mesh by its address: a file's path (mesh_import.h lists the formats), or an object of a furniture library,
// "catalog.sh3f#barrel" (furniture_catalog.h). A file's licence is that of a licence file beside it (a name with
// "licen" or "copying" in it, without ending or .txt, .html, .md), the first that names one (licence.h); where none
// does, the licence says so and which file to read. The object's name is the file's.
//
// Errors: kNotFound: no such file or object; otherwise as ImportMesh and FurnitureCatalog::Open.
Result<ImportedMesh> ReadMesh(const std::string& address, const MeshReadOptions& options = {});

// What an address stands for: itself, or every object of the library when it is one without "#object". Errors as
// FurnitureCatalog::Open. Whether files exist is not asked.
Result<std::vector<std::string>> ExpandMeshAddress(const std::string& address);

// True when the address looks like a mesh: a mesh's file name, a furniture library or an object of one.
bool IsMeshAddress(const std::string& address);

// True for a whole library.
bool IsMeshLibrary(const std::string& address);

// A short name for files made from the mesh: "barrel" of "models/barrel.obj" and of "catalog.sh3f#barrel". Only
// the ending of a mesh's or a library's file goes: "catalog.sh3f#chair.v2" is "chair.v2".
std::string MeshShortName(const std::string& address);

}  // namespace anchorsplat

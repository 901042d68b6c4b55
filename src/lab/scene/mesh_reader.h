#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "scene/mesh_import.h"

namespace anchorsplat {

// Reads a mesh by address: a file's path (formats: mesh_import.h), or an object of a furniture library,
// "catalog.sh3f#barrel" (furniture_catalog.h). A file's licence comes from licence files beside it (names with "licen"
// or "copying", without extension or .txt, .html, .md), the first that names one (licence.h); if none does, the licence
// says so and which file to read. The object is named after the file.
//
// Errors: kNotFound: no such file or object; else those of ImportMesh and FurnitureCatalog::Open.
Result<ImportedMesh> ReadMesh(const std::string& address, const MeshReadOptions& options = {});

// Expands an address: a library without "#object" into all its objects, any other into itself. Errors: those of
// FurnitureCatalog::Open. Does not check that files exist.
Result<std::vector<std::string>> ExpandMeshAddress(const std::string& address);

// Whether the address looks like a mesh file, a furniture library or an object of one.
bool IsMeshAddress(const std::string& address);

// True for a whole library.
bool IsMeshLibrary(const std::string& address);

// Short name for files made from the mesh: "barrel" for "models/barrel.obj" and "catalog.sh3f#barrel". Drops only known
// extensions: "catalog.sh3f#chair.v2" gives "chair.v2".
std::string MeshShortName(const std::string& address);

}  // namespace anchorsplat

#pragma once

#include <filesystem>

#include "core/result.h"
#include "io/write_options.h"
#include "scene/mesh.h"

namespace anchorsplat {

// A mesh with textures as one safetensors file, bit for bit, so that a data set can render an object's views again.
// Tensors: positions [V,3]; if present normals [V,3], uvs [V,2] and colors [V,4]; triangles [T,3], triangle_materials
// [T], materials [M,4] (diffuse and opacity), material_textures [M], material_flags [M] (bit 0: two-sided), texture.0 …
// [H,W,4] bytes. Names are lost.

// Errors: kBadArgument (an invalid mesh), kExists, kNotFound, kIo.
Status WriteMeshFile(const std::filesystem::path& path, const Mesh& mesh, const WriteOptions& options = {});

// Reads and validates a mesh. Errors: those of TensorFile; kBadFile: tensors missing, of the wrong shape or type, or
// inconsistent.
Result<Mesh> ReadMeshFile(const std::filesystem::path& path);

}  // namespace anchorsplat

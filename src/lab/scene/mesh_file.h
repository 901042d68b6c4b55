#pragma once

#include <filesystem>

#include "core/result.h"
#include "io/write_options.h"
#include "scene/mesh.h"

namespace anchorsplat {

// A mesh with its textures as one safetensors file, bit by bit as it is in memory: what a data set keeps of an object
// whose views are to be made again later. Tensors: positions [V,3], where the mesh has them normals [V,3], uvs [V,2]
// and colors [V,4], triangles [T,3], triangle_materials [T], materials [M,4] (diffuse and opacity), material_textures
// [M], material_flags [M] (bit 0: two-sided), texture.0 … [H,W,4] of bytes. Names are not kept.

// Errors: kBadArgument (an invalid mesh), kExists, kNotFound, kIo.
Status WriteMeshFile(const std::filesystem::path& path, const Mesh& mesh, const WriteOptions& options = {});

// The result is valid. Errors: as TensorFile; kBadFile for tensors that are missing, of another shape or type, or do
// not fit together.
Result<Mesh> ReadMeshFile(const std::filesystem::path& path);

}  // namespace anchorsplat

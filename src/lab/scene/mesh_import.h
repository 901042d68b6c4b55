#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"
#include "scene/asset_source.h"
#include "scene/mesh.h"

namespace anchorsplat {

// Limits on a mesh file. The defaults allow every model a splat could be made from and protect against hostile files.
struct MeshLimits {
  uint64_t max_file_bytes = uint64_t{1} << 29;     // of the mesh file and of each file it names
  int64_t max_vertices = int64_t{1} << 25;         // as in the file, after instancing
  int64_t max_polygon = 10'000;                    // corners of a face: triangulation takes quadratic time
  int64_t max_texture_pixels = int64_t{1} << 26;   // per picture
  uint64_t max_memory = uint64_t{8} << 30;         // bytes for reading
  int max_cpu_seconds = 120;                       // processor time for reading
  int64_t max_textures_pixels = int64_t{1} << 28;  // all pictures together
};

struct MeshReadOptions {
  MeshLimits limits;
  bool isolated = true;        // reads in a separate process, as the library crashes on damaged files; false for tests
  float smoothing_angle = 45;  // degrees; sharper edges stay sharp if the file has no normals
};

// Origin of an object; unknown fields are empty.
struct MeshOrigin {
  std::string name;            // "Cartoon biplane"
  std::string category;        // "Vehicles"
  std::string creator;         // "robo3dguy"
  std::string licence;         // SPDX identifier of a common licence ("CC0-1.0"), else the file's words
  std::string licence_source;  // file that states it
};

struct ImportedMesh {
  Mesh mesh;  // valid, without degenerate or non-finite triangles
  MeshOrigin origin;
  std::vector<std::string> warnings;  // missing textures and materials by name, number of faces left out
  int64_t degenerate = 0;             // triangles left out: no area
  int64_t not_finite = 0;             // triangles left out: NaN or infinite corner
  int64_t lines_and_points = 0;       // elements left out: no faces
  bool has_normals = false;           // the file has normals for all faces; else they were computed (smooth_normals.h)
};

// Reads `name` and the files it refers to from `source`. The extension determines the format: OBJ, glTF and GLB (with
// embedded pictures), PLY, COLLADA, AC3D, STL and OFF. Uses assimp in a separate process.
//
// Colours and pictures are sRGB values; glTF's linear factors are converted. A picture replaces the material's colour:
// the diffuse colour beside it in OBJ and COLLADA files is usually an exporter's default. glTF and AC3D define the
// product, which is baked into the picture. Opaque materials of glTF drop the picture's alpha. A separate opacity
// picture (`map_d`) is left out with a warning.
//
// Errors, starting with `where`: kNotFound; kBadFile: an unknown extension, a file that assimp rejects (with its
// reason), limits exceeded, no triangle.
Result<ImportedMesh> ImportMesh(const AssetSource& source, const std::string& name, const std::string& where,
                                const MeshReadOptions& options = {});

// Whether the name has one of these extensions, in any case.
bool IsMeshName(const std::string& name);

}  // namespace anchorsplat

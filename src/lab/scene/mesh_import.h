#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"
#include "scene/asset_source.h"
#include "scene/mesh.h"

namespace anchorsplat {

// What a mesh file may take. The defaults hold every model that a splat could be made from, and keep a hostile file
// from taking the machine's memory.
struct MeshLimits {
  uint64_t max_file_bytes = uint64_t{1} << 29;     // of the mesh file and of each file it names
  int64_t max_vertices = int64_t{1} << 25;         // as the file has them, after instancing
  int64_t max_polygon = 10'000;                    // corners of one face: cutting it up takes time quadratic in them
  int64_t max_texture_pixels = int64_t{1} << 26;   // of one picture
  uint64_t max_memory = uint64_t{8} << 30;         // bytes that reading the file may take
  int max_cpu_seconds = 120;                       // and processor time
  int64_t max_textures_pixels = int64_t{1} << 28;  // of all pictures together
};

struct MeshReadOptions {
  MeshLimits limits;
  bool isolated = true;        // read in a process of its own, as the library falls over damaged files; false for tests
  float smoothing_angle = 45;  // degrees; edges that are sharper stay sharp where a file gives no normals
};

// Where an object comes from; what is not known is empty.
struct MeshOrigin {
  std::string name;            // "Cartoon biplane"
  std::string category;        // "Vehicles"
  std::string creator;         // "robo3dguy"
  std::string licence;         // SPDX identifier where it is one of the usual ones ("CC0-1.0"), else the file's words
  std::string licence_source;  // the file that says so
};

struct ImportedMesh {
  Mesh mesh;  // valid; no triangle without area or with a corner that is not finite
  MeshOrigin origin;
  std::vector<std::string> warnings;  // missing textures and materials by name, faces left out with their count
  int64_t degenerate = 0;             // triangles left out: without area
  int64_t not_finite = 0;             // triangles left out: a corner is NaN or infinite
  int64_t lines_and_points = 0;       // elements left out that are no faces
  bool has_normals = false;           // the file gave normals for all faces; others were made (smooth_normals.h)
};

// Reads `name` and what it refers to from `source`. The format is found by the name's ending: OBJ, glTF and GLB
// (embedded pictures included), PLY, COLLADA, AC3D, STL and OFF, through assimp, which runs in a process of its own.
//
// Colours and pictures: as sRGB values; glTF's linear factors are converted. Where a material has a picture, that is
// its colour: the diffuse colour beside it in OBJ and COLLADA files is an exporter's default more often than
// meant. glTF and AC3D define the product, which is then baked into the picture. glTF's opaque materials lose the
// picture's alpha. A separate opacity picture (`map_d`) that is not the colour picture is left out with a warning.
//
// Errors, beginning with `where`: kNotFound; kBadFile: an ending of another format, a file assimp refuses (its reason
// is given), more than the limits, no triangle at all.
Result<ImportedMesh> ImportMesh(const AssetSource& source, const std::string& name, const std::string& where,
                                const MeshReadOptions& options = {});

// True for the endings above, in any case.
bool IsMeshName(const std::string& name);

}  // namespace anchorsplat

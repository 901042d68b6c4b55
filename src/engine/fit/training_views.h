#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/result.h"
#include "fit/initial_points.h"

namespace anchorsplat {

// Input of a fit: views with pictures, and points if the project has them. Coordinates are the project's, neither
// rotated nor scaled, relative to `origin`; that is zero unless the coordinates are too large for float
// (core/world_origin.h).
struct TrainingViews {
  WorldOrigin origin = {0, 0, 0};
  std::vector<Camera> train;     // sorted by name, each with a picture and intrinsics for the picture's size
  std::vector<Camera> held_out;  // the same, never trained on
  std::optional<std::array<float, 3>> background;  // of the pictures, if the project says
  std::vector<std::string> without_picture;        // views of the camera file left out for lack of a picture
  InitialPoints points;                            // may be empty
  double scene_scale = 1;  // 1.1 × the largest distance of a camera's centre from their mean; world units
};

struct ProjectOptions {
  // Holds out every Nth view in order of names; 0: none. Projects with a transforms_test.json hold out those views
  // instead.
  int hold_out = 8;
  int downscale = 1;                       // averages pictures over squares of this side; 1 to kMaxDownscale
  std::optional<WorldOrigin> origin = {};  // of an existing splat; unset: ChooseOrigin of the cameras
};

// Opens a project: a folder with transforms_train.json and perhaps transforms_test.json (NeRF-synthetic; logs if there
// are other cameras beside them), a COLMAP project (sparse/0, images), any other file that ReadCameras takes or its
// folder, or a folder of such folders named by resolution (256/ and 1024/, or 200/ and 800/), of which the smallest is
// used. Leaves out views without a picture, with a warning.
//
// Cameras match the pictures of PictureCache: upright, undistorted, averaged down (cameras/photograph.h). Pictures of
// another size than the camera file's count as scaled if the aspect ratio agrees. Points come from a COLMAP model
// (points3D.bin, .txt or .ply) or the PLY named by a transforms.json. The background comes from the cameras' file or,
// for a COLMAP folder 128, from transforms_128.json beside it.
//
// Errors: those of ReadCameras for who needs pictures, ReadColmapPoints, ReadPlyPoints, MatchPhotograph; kNotFound: no
// view has a picture, or the PLY is missing; kBadArgument: hold_out leaves nothing to train on.
Result<TrainingViews> OpenProject(const std::filesystem::path& project, const ProjectOptions& options = {});

// How a fit's initial points are chosen.
enum class FitInit {
  kAuto,    // kPoints if the project has points, else kView
  kPoints,  // the project's points
  kView,    // random points where many cameras look
  kRandom,  // random points in gsplat's cube
};
// Command-line name of `init`, with kAuto resolved.
const char* NameOf(FitInit init, const TrainingViews& views);

// The project's points, subsampled to `count`, or that many random ones; by default all, or kRandomPoints. `extent`:
// see RandomPoints. kBadArgument: kPoints for a project without points.
Result<InitialPoints> InitialPointsOf(FitInit init, const TrainingViews& views, std::optional<int64_t> count,
                                      uint64_t seed, double extent = kRandomExtent);

// 1.1 × the largest distance of a camera's centre from their mean; 1 if all coincide.
double SceneScale(const std::vector<Camera>& cameras);

}  // namespace anchorsplat

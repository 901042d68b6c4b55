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

// What a fit starts from: views with pictures, and points where the project has them. World coordinates are the
// project's own; nothing is turned or scaled. Cameras and points are seen from `origin`, which is zero but where the
// project's coordinates are too large for floats (core/world_origin.h).
struct TrainingViews {
  WorldOrigin origin = {0, 0, 0};
  std::vector<Camera> train;     // sorted by name; every one has a picture, and intrinsics for the picture's size
  std::vector<Camera> held_out;  // the same, never trained on
  std::optional<std::array<float, 3>> background;  // where the project says which one its pictures have
  std::vector<std::string> without_picture;        // names of the camera file's views that are left out for that
  InitialPoints points;                            // may be none
  double scene_scale = 1;  // 1.1 × the largest distance of a camera's centre from their mean; world units
};

struct ProjectOptions {
  // Views whose place in the order of names is a multiple of this are held out; 0: none are. Projects with a
  // transforms_test.json hold out those instead.
  int hold_out = 8;
  int downscale = 1;  // pixels of a picture per side that become one, their mean; 1 to kMaxDownscale
  std::optional<WorldOrigin> origin = {};  // of a splat that is there already; nothing: ChooseOrigin of the cameras
};

// Opens a project: a folder with transforms_train.json and perhaps transforms_test.json (NeRF-synthetic; a
// message names other cameras beside them), a COLMAP project (sparse/0, images), any other file that ReadCameras takes
// or its folder, or a folder of such folders named by resolution (256/ and 1024/, or 200/ and 800/), of which the
// smallest is taken. Views of the camera file without a picture are left out with a warning.
//
// Cameras are those of the pictures that PictureCache gives: upright, without the lens, averaged down
// (cameras/photograph.h). Pictures of another size than the camera file says are taken as scaled ones when the shape
// agrees. Points are those of a COLMAP model (points3D.bin, .txt or .ply), or of the PLY that a transforms.json names.
//
// A COLMAP project does not say which background its pictures have; a transforms_128.json beside a folder 128 does.
//
// Errors: those of ReadCameras for who needs pictures, ReadColmapPoints, ReadPlyPoints, MatchPhotograph; kNotFound: no
// view has a picture, or when the PLY is missing; kBadArgument when hold_out leaves nothing to train on.
Result<TrainingViews> OpenProject(const std::filesystem::path& project, const ProjectOptions& options = {});

// Where a fit's first Gaussians stand.
enum class FitInit {
  kAuto,    // kPoints where the project has some, else kView
  kPoints,  // the project's points
  kView,    // random points where many cameras look
  kRandom,  // random points in gsplat's cube
};
// The word of the command line and of records for what kAuto turns out to be, and for the others.
const char* NameOf(FitInit init, const TrainingViews& views);

// The points of the project, thinned to `count`, or as many random ones; all of them or kRandomPoints where nobody
// says. `extent`: RandomPoints'. kBadArgument: kPoints, and the project has none.
Result<InitialPoints> InitialPointsOf(FitInit init, const TrainingViews& views, std::optional<int64_t> count,
                                      uint64_t seed, double extent = kRandomExtent);

// 1.1 × the largest distance of a centre from their mean; 1 when all are in one place.
double SceneScale(const std::vector<Camera>& cameras);

}  // namespace anchorsplat

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "core/camera.h"
#include "core/result.h"
#include "scene/camera_rig.h"
#include "scene/ray_tracer.h"

namespace anchorsplat {

// Views of an object at two resolutions, in the layout of the 3DGS-SR benchmark:
//
//   DIR/256/   images/000.png …   cameras.txt images.txt   sparse/0/{cameras,images,points3D}.bin
//   DIR/1024/  images/000.png …   cameras.txt images.txt
//   DIR/transforms_256.json  DIR/transforms_1024.json     (the same cameras; pictures as 256/images/000.png)
//
// Folders are named after the picture side in pixels. Both resolutions are rendered; neither is scaled from the other.
// Pictures are RGBA with straight alpha: rgb·a + background·(1−a) is the view.
struct ViewSetOptions {
  CameraRig rig;
  int high_size = 1024;  // pixels per side
  int low_size = 256;
  TraceOptions trace;
  std::array<float, 3> background = {0, 0, 0};  // stated in the camera files
  bool opaque = false;                          // RGB pictures on `background`, for readers that drop alpha
  int64_t points = 20000;                       // visible surface samples for points3D.bin
  uint64_t seed = 0;
  bool store_high = true;  // false: stores only the cameras of high views; pictures are rendered on demand
  bool overwrite = false;
};

struct ViewSetCost {
  TraceCost low;
  TraceCost high;
  double picture_seconds = 0;  // encoding and writing PNGs, processor time over all threads
  double point_seconds = 0;    // surface samples
  double seconds = 0;          // total, wall clock
};

// Cameras of both resolutions. kBadArgument: as MakeRig; sizes out of range or equal.
struct ViewSetCameras {
  CameraSet low;
  CameraSet high;
};
Result<ViewSetCameras> MakeViewSetCameras(const ViewSetOptions& options);

// Renders a view exactly as stored: quantised to 8 bits per channel, as a float image.
Result<Image> RenderStoredView(const RayTracer& tracer, const Camera& camera, const ViewSetOptions& options,
                               TraceCost* cost = nullptr);

// WriteViewSet for arbitrary cameras: both sets at the same places in the same order, with pictures `options.low_size`
// and `options.high_size` wide; ignores the rig. `keep`: existing pictures are from an interrupted run and stay; other
// files are rewritten. Errors: those of WriteViewSet; kBadArgument: sets empty or of different length.
Result<ViewSetCost> WriteViews(const RayTracer& tracer, const std::filesystem::path& folder,
                               const ViewSetCameras& cameras, const ViewSetOptions& options, bool keep = false);

// Creates and fills `folder`. Stops between two views if asked to (core/run_context.h; kInterrupted). Errors: kExists
// unless options.overwrite; kIo; those of MakeViewSetCameras.
Result<ViewSetCost> WriteViewSet(const RayTracer& tracer, const std::filesystem::path& folder,
                                 const ViewSetOptions& options);

}  // namespace anchorsplat

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

// Views of one object at two resolutions, in the layout of the 3DGS-SR benchmark:
//
//   DIR/256/   images/000.png …   cameras.txt images.txt   sparse/0/{cameras,images,points3D}.bin
//   DIR/1024/  images/000.png …   cameras.txt images.txt
//   DIR/transforms_256.json  DIR/transforms_1024.json     (the same cameras; pictures as 256/images/000.png)
//
// The folders are called after the pixels of a side. Both resolutions are rendered, neither is a scaled copy of the
// other. Pictures are RGBA with straight alpha: rgb·a + background·(1−a) is the view.
struct ViewSetOptions {
  CameraRig rig;
  int high_size = 1024;  // pixels per side
  int low_size = 256;
  TraceOptions trace;
  std::array<float, 3> background = {0, 0, 0};  // what the cameras' files name
  bool opaque = false;                          // RGB pictures on `background` instead, for readers that drop alpha
  int64_t points = 20000;                       // samples of the visible surface, for points3D.bin
  uint64_t seed = 0;
  bool store_high = true;  // false: the high views' cameras only; their pictures are made again when they are wanted
  bool overwrite = false;
};

struct ViewSetCost {
  TraceCost low;
  TraceCost high;
  double picture_seconds = 0;  // encoding and writing PNGs, processor time over all threads
  double point_seconds = 0;    // surface samples
  double seconds = 0;          // of everything, by the clock
};

// The two sets of cameras, low first. kBadArgument: as MakeRig, sizes out of range or equal.
struct ViewSetCameras {
  CameraSet low;
  CameraSet high;
};
Result<ViewSetCameras> MakeViewSetCameras(const ViewSetOptions& options);

// One view as it would be stored: 8 bits a channel, as float image. Views rendered anew are the stored ones bit by bit.
Result<Image> RenderStoredView(const RayTracer& tracer, const Camera& camera, const ViewSetOptions& options,
                               TraceCost* cost = nullptr);

// As WriteViewSet, of any cameras: two sets of the same places in the same order, whose pictures are `options.low_size`
// and `options.high_size` wide. The rig is not looked at. `keep`: pictures that are there already are those of an
// earlier run that was stopped, and stay; all other files are written anew.
// Errors as WriteViewSet; kBadArgument: sets of different length, or none.
Result<ViewSetCost> WriteViews(const RayTracer& tracer, const std::filesystem::path& folder,
                               const ViewSetCameras& cameras, const ViewSetOptions& options, bool keep = false);

// Makes `folder` and fills it. When the run is asked to stop (core/run_context.h) it ends between two views
// (kInterrupted). Errors: kExists unless options.overwrite; kIo; as MakeViewSetCameras.
Result<ViewSetCost> WriteViewSet(const RayTracer& tracer, const std::filesystem::path& folder,
                                 const ViewSetOptions& options);

}  // namespace anchorsplat

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// A scene given as pictures instead of a mesh: a NeRF-synthetic folder, a COLMAP project such as MVImgNet's, or
// anything that fit/training_views.h opens. Its pictures become the high views; reduced ones become the low views.
struct PictureProjectOptions {
  int downscale = 4;                            // high pixels per low pixel side
  std::array<float, 3> background = {0, 0, 0};  // if the project states none
  int64_t random_points = 100000;               // initial points for projects without points
  uint64_t seed = 0;                            // of those
};

struct PictureProjectReport {
  int views = 0;
  int low_size = 0;  // picture width in pixels, after which the folder is named
  int high_size = 0;
  int64_t points = 0;
  std::array<float, 3> background = {0, 0, 0};
  double seconds = 0;
};

// Fills `folder` like WriteViewSet (view_set.h), with files named after the project's pictures, as PNGs (copies if they
// already are). NeRF-synthetic scenes provide only their training views. Stops between two views if asked to
// (core/run_context.h; kInterrupted).
//
// Errors: those of OpenProject and ReadImage; kBadArgument: cameras or sizes that differ between views (the layout has
// one camera), pictures too small to reduce, views of equal name.
Result<PictureProjectReport> WritePictureProject(const std::filesystem::path& project,
                                                 const std::filesystem::path& folder,
                                                 const PictureProjectOptions& options);

// Reduces a picture: each pixel is the average of the area it covers, with colours weighted by alpha if present.
// `width` and `height`: at least 1, at most the picture's.
Image AreaAveraged(const Image& image, int width, int height);

}  // namespace anchorsplat

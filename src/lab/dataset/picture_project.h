#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// A scene that comes as pictures instead of as a mesh: a NeRF-synthetic folder, a COLMAP project such as MVImgNet's, or
// whatever else fit/training_views.h opens. Its pictures become the high views, the same made smaller the low ones.
struct PictureProjectOptions {
  int downscale = 4;                            // high pixels per low one, along a side
  std::array<float, 3> background = {0, 0, 0};  // where the project does not say which one its pictures have
  int64_t random_points = 100000;               // initial points of projects that have none
  uint64_t seed = 0;                            // of those
};

struct PictureProjectReport {
  int views = 0;
  int low_size = 0;  // pixels of a picture's width, after which the folders are called
  int high_size = 0;
  int64_t points = 0;
  std::array<float, 3> background = {0, 0, 0};
  double seconds = 0;
};

// Fills `folder` as WriteViewSet does (view_set.h), except that the files are called after the project's pictures, and
// are PNGs whatever those were: copies, where they are PNGs too. NeRF-synthetic scenes give their training views only.
// When the run is asked to stop (core/run_context.h) it ends between two views (kInterrupted).
//
// Errors: those of OpenProject and ReadImage; kBadArgument: cameras or sizes that differ from view to view (the layout
// has one camera), pictures too small to be made smaller, views of one name.
Result<PictureProjectReport> WritePictureProject(const std::filesystem::path& project,
                                                 const std::filesystem::path& folder,
                                                 const PictureProjectOptions& options);

// A smaller picture: every pixel is the average of the area it covers, colours weighted by alpha where there is one.
// Sizes at least 1 and at most the picture's.
Image AreaAveraged(const Image& image, int width, int height);

}  // namespace anchorsplat

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "cameras/undistortion.h"
#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

struct CaptureFolder {
  std::string name;
  std::filesystem::path folder;
};

// The captures in a folder, in order of their names: the folders in it, or `folder` itself if it has cameras.
//
// Errors: kNotFound: no folder, nothing in it.
Result<std::vector<CaptureFolder>> FindCaptures(const std::filesystem::path& folder);

// How photographs with their cameras become a pair: a splat is fitted to small pictures of some views, and the others
// say at full size what it should look like.
struct CaptureRecipe {
  int downscale = 4;     // pixels of a picture per side that become one of those that are fitted
  int hold_out = 8;      // every so many views are held out, unless the project says which are
  int64_t steps = 1000;  // of the fit, otherwise FitOptionsFor's, with a far shell where pictures ask for one
  uint64_t seed = 0;     // of the fit
};

// Such a pair. Views are in order of their names, and world coordinates are the project's own.
struct Capture {
  std::string name;
  std::array<float, 3> background{};
  std::vector<Camera> views;  // at full size, without the pixels at the right and bottom that `downscale` leaves over
  std::vector<Camera> low_views;  // the same views as they are fitted
  std::vector<size_t> held_out;   // of both: views that the fit has not seen
  std::filesystem::path splat;    // file of the fit
  GaussianCloud cloud;            // the fit

  std::vector<Camera> FittedViews() const;  // those of low_views that are not held out
};

// Opens the capture in `project` (fit/training_views.h says what may be one) and fits a splat to it, unless
// `fit_folder` has that fit already (dataset/kept_fit.h). `name` is for messages.
//
// Errors: those of OpenProject and FitAndKeep.
Result<Capture> OpenCapture(const std::string& name, const std::filesystem::path& project, const CaptureRecipe& recipe,
                            const std::filesystem::path& fit_folder);

// The photograph of one of Capture::views, of that camera's size.
//
// Errors: those of ReadPhotograph.
Result<ViewPicture> FullPicture(const Camera& view);

}  // namespace anchorsplat

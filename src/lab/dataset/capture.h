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

// Lists the captures in a folder by name: its folders, or `folder` itself if it has cameras.
//
// Errors: kNotFound: no folder, or nothing in it.
Result<std::vector<CaptureFolder>> FindCaptures(const std::filesystem::path& folder);

// How a capture (photographs with cameras) becomes a pair: a splat is fitted to reduced pictures of some views, and the
// others show at full size what it should look like.
struct CaptureRecipe {
  int downscale = 4;     // reduction factor of the fitted pictures
  int hold_out = 8;      // holds out every Nth view, unless the project names them
  int64_t steps = 5000;  // of the fit; otherwise FitOptionsFor, with a far shell if the pictures need one
  uint64_t seed = 0;     // of the fit
};

// The pair. Views are sorted by name; world coordinates are the project's.
struct Capture {
  std::string name;
  std::array<float, 3> background{};
  std::vector<Camera> views;      // at full size, cropped at the right and bottom to a multiple of `downscale`
  std::vector<Camera> low_views;  // the same views as fitted
  std::vector<size_t> held_out;   // indices of views that the fit was not trained on
  std::filesystem::path splat;    // file of the fit
  GaussianCloud cloud;            // the fit

  std::vector<Camera> FittedViews() const;  // low_views without held-out ones
};

// Opens the capture in `project` (anything OpenProject of fit/training_views.h takes) and fits a splat to it, unless
// `fit_folder` already has that fit (dataset/kept_fit.h). `name`: for messages.
//
// Errors: those of OpenProject and FitAndKeep.
Result<Capture> OpenCapture(const std::string& name, const std::filesystem::path& project, const CaptureRecipe& recipe,
                            const std::filesystem::path& fit_folder);

// Reads the photograph of one of Capture::views, at its camera's size.
//
// Errors: those of ReadPhotograph.
Result<ViewPicture> FullPicture(const Camera& view);

}  // namespace anchorsplat

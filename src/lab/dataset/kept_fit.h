#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/fit_options.h"
#include "fit/training_views.h"

namespace anchorsplat {

// Input of a fit.
struct FitTask {
  TrainingViews views;
  GaussianCloud initial;
  FitOptions options;
};

struct KeptFit {
  GaussianCloud cloud;
  double seconds = 0;     // over all attempts, including `start`
  double train_psnr = 0;  // dB over the fitted pictures
};

// Path of the splat of a fit kept in `folder`.
std::filesystem::path KeptSplat(const std::filesystem::path& folder);

// Runs a fit in a folder of its own, or resumes or reuses it. `key`: everything the result depends on; contents with
// another key are removed first. `start`: called only if there is work; may keep files of its own in the folder.
//
// Errors: kIo: the folder; those of `start` and Fit.
Result<KeptFit> FitAndKeep(const std::filesystem::path& folder, const std::string& key,
                           const std::function<Result<FitTask>()>& start);

}  // namespace anchorsplat

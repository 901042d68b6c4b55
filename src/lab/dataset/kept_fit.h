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

// What a fit begins with.
struct FitTask {
  TrainingViews views;
  GaussianCloud initial;
  FitOptions options;
};

struct KeptFit {
  GaussianCloud cloud;
  double seconds = 0;     // of all attempts, what `start` took included
  double train_psnr = 0;  // dB, over the pictures that it was fitted to
};

// Of a fit that is kept in `folder`.
std::filesystem::path KeptSplat(const std::filesystem::path& folder);

// The fit of `start` in a folder of its own: one that was stopped goes on, one that is done is read. `key` says all
// that its result depends on; what was kept with another key is removed first. `start` is called only where there is
// something to do, and may keep files of its own in the folder.
//
// Errors: kIo: the folder; those of `start` and Fit.
Result<KeptFit> FitAndKeep(const std::filesystem::path& folder, const std::string& key,
                           const std::function<Result<FitTask>()>& start);

}  // namespace anchorsplat

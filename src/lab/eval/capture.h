#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/result.h"
#include "eval/benchmark.h"
#include "eval/protocol.h"

namespace anchorsplat {

// How a capture, photographs with their cameras, becomes an object of a benchmark: a splat is fitted to small pictures
// and measured with those of full size.
struct CaptureRecipe {
  int downscale = 4;             // pixels of a picture per side that become one of those that are fitted
  int hold_out = kHeldOutEvery;  // every so many views are held out, unless the project says which are
  int64_t steps = 1000;          // of the fit, otherwise FitOptionsFor's, with a far shell where pictures ask for one
};

// The objects of a folder of captures, in order of their names: the folders in it, or `folder` itself if it has
// cameras. Folders of the layout of the repository's examples have a splat and are no captures, but objects all the
// same.
//
// Errors: kNotFound: no folder, nothing in it.
Result<std::vector<BenchmarkEntry>> ListCaptures(const std::filesystem::path& folder);

// The object that the recipe makes of a capture, which is whatever OpenProject (fit/training_views.h) opens. High views
// are without the pixels at the right and at the bottom that `downscale` leaves over. The fit is made here where
// `fit_folder` does not hold it yet (eval/kept_fit.h).
//
// Errors: those of OpenProject and FitAndKeep.
Result<BenchmarkObject> OpenCapture(const BenchmarkEntry& entry, const CaptureRecipe& recipe, uint64_t seed,
                                    const std::filesystem::path& fit_folder);

}  // namespace anchorsplat

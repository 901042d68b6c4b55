#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "dataset/capture.h"
#include "eval/benchmark.h"

namespace anchorsplat {

// The objects of a folder of captures, in order of their names: the folders in it, or `folder` itself if it has
// cameras. Folders of the layout of the repository's examples have a splat and are no captures, but objects all the
// same.
//
// Errors: kNotFound: no folder, or nothing in it.
Result<std::vector<BenchmarkEntry>> ListCaptures(const std::filesystem::path& folder);

// The object that the recipe makes of a capture (dataset/capture.h). The fit is made here where `fit_folder` does not
// hold it yet.
//
// Errors: those of OpenCapture.
Result<BenchmarkObject> OpenCapturedObject(const BenchmarkEntry& entry, const CaptureRecipe& recipe,
                                           const std::filesystem::path& fit_folder);

}  // namespace anchorsplat

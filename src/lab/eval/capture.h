#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "dataset/capture.h"
#include "eval/benchmark.h"

namespace anchorsplat {

// Lists a folder of captures by name: its folders, or `folder` itself if it has cameras. Folders in the examples'
// layout,
// which have a splat, are listed as ordinary objects.
//
// Errors: kNotFound: no folder, or nothing in it.
Result<std::vector<BenchmarkEntry>> ListCaptures(const std::filesystem::path& folder);

// Makes a benchmark object of a capture (dataset/capture.h). Fits the splat unless `fit_folder` already has it.
//
// Errors: those of OpenCapture.
Result<BenchmarkObject> OpenCapturedObject(const BenchmarkEntry& entry, const CaptureRecipe& recipe,
                                           const std::filesystem::path& fit_folder);

}  // namespace anchorsplat

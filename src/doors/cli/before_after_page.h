#pragma once

#include <filesystem>
#include <span>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/enhance.h"
#include "io/write_options.h"

namespace anchorsplat {

// The page that `enhance --view` writes beside its output: scan-4x.ply and scan-4x.html.
std::filesystem::path PagePath(const std::filesystem::path& output);

// Errors: kBadArgument where two outputs would have one page.
Status CheckPages(std::span<const std::filesystem::path> outputs);

// That a page of `before` and of what will come of it is not far beyond what a browser opens (kBadArgument): estimated,
// before the work begins.
Status CheckPageFits(const std::filesystem::path& output, const GaussianCloud& before, const EnhanceOptions& options);

// Errors say that `output` is written all the same.
Status WritePage(const std::filesystem::path& input, const GaussianCloud& before, const std::filesystem::path& output,
                 const Enhanced& enhanced, const WriteOptions& options);

}  // namespace anchorsplat

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

// Errors: kBadArgument if two outputs would have the same page.
Status CheckPages(std::span<const std::filesystem::path> outputs);

// Estimates before the work whether a page of `before` and its result would be too large for a browser (kBadArgument).
Status CheckPageFits(const std::filesystem::path& output, const GaussianCloud& before, const EnhanceOptions& options);

// Errors say that `output` itself was written.
Status WritePage(const std::filesystem::path& input, const GaussianCloud& before, const std::filesystem::path& output,
                 const Enhanced& enhanced, const WriteOptions& options);

}  // namespace anchorsplat

#pragma once

#include <filesystem>

#include "core/image.h"
#include "core/result.h"
#include "eval/evaluation.h"

namespace anchorsplat {

// A sheet with a row per object, a column per method and the truth last. Shows the excerpts that Evaluate wrote to
// `out`, enlarged by integer factors, with the object's PSNR below, and at the bottom the credits
// (Evaluation::credits). At most kMostSheetObjects objects, evenly chosen; those without results are left out. Empty
// image if there are none.
// Errors: kBadFile, kIo: unreadable excerpts.
inline constexpr size_t kMostSheetObjects = 40;
Result<Image> ContactSheet(const std::filesystem::path& out, const Evaluation& evaluation);

}  // namespace anchorsplat

#pragma once

#include <filesystem>

#include "core/image.h"
#include "core/result.h"
#include "eval/evaluation.h"

namespace anchorsplat {

// A row per object, a column per method and the truth last: the excerpts that Evaluate kept in `out`, enlarged by whole
// multiples, with the object's PSNR below, and below all whose the objects are (Evaluation::credits). At most
// kMostSheetObjects objects, evenly spread; those without results are left out. An empty image when there are none.
// Errors: kBadFile, kIo for excerpts that cannot be read.
inline constexpr size_t kMostSheetObjects = 40;
Result<Image> ContactSheet(const std::filesystem::path& out, const Evaluation& evaluation);

}  // namespace anchorsplat

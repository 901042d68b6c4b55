#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "core/world_origin.h"
#include "io/json_file.h"

namespace anchorsplat {

// The member "asset" of a JSON file, as defined by glTF and adopted by SOG. `generator` is ours; `copyright` has the
// credits, one per line; `extras.comments` has the marks and up direction (core/splat_comments.h) and, if not zero, the
// origin of the means (core/world_origin.h). Empty members are omitted.
nlohmann::json AssetOf(std::span<const std::string> comments, const WorldOrigin& origin);

// Credits, marks, up directions and origin of such a file, as comments; none if absent or not text. kBadFile: over a
// mebibyte of credits.
Result<std::vector<std::string>> CommentsOfAsset(const JsonValue& root);

// Names of unknown members; and a warning for those that may concern axes, whose meaning is unknown.
std::vector<std::string> OtherEntries(const JsonValue& root, std::span<const std::string_view> known);
void WarnOfAxisEntries(const std::string& file, std::span<const std::string> others);

}  // namespace anchorsplat

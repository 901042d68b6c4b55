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

// The member "asset" of a file that is JSON, as glTF defines it and SOG took it over: what made the file, and whose it
// is. `generator` is ours; `copyright` are the credits, a line each, and `extras.comments` the marks, where up is
// (core/splat_comments.h) and, where it is not zero, the origin of the means (core/world_origin.h); neither is there
// where there are none.
nlohmann::json AssetOf(std::span<const std::string> comments, const WorldOrigin& origin);

// The credits, marks, ups and origin that such a file says, as comments; none where it says nothing, or no text.
// kBadFile: a mebibyte of credits.
Result<std::vector<std::string>> CommentsOfAsset(const JsonValue& root);

// Names of members that a format does not have, and a warning for those that may speak of axes: nobody knows what they
// would mean.
std::vector<std::string> OtherEntries(const JsonValue& root, std::span<const std::string_view> known);
void WarnOfAxisEntries(const std::string& file, std::span<const std::string> others);

}  // namespace anchorsplat

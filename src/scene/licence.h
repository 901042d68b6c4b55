#pragma once

#include <string>
#include <string_view>

namespace anchorsplat {

// The SPDX identifier of the Creative Commons licence that a text (plain or HTML) names first, by its address or by its
// usual names: "CC0-1.0", "CC-BY-3.0", "CC-BY-3.0-US", "CC-BY-SA-4.0" … "" when there is none.
std::string SpdxIdentifier(std::string_view text);

// Whether a text speaks of CC-BY without a version: pictures that were added to a model under CC0, for example.
bool MentionsAttribution(std::string_view text);

}  // namespace anchorsplat

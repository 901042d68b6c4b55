#pragma once

#include <string>
#include <string_view>

namespace anchorsplat {

// The SPDX identifier of the licence that a text (plain or HTML) names first, by its address, its usual names or the
// words it begins with: Creative Commons ("CC0-1.0", "CC-BY-3.0", "CC-BY-3.0-US", "CC-BY-SA-4.0" …), the GNU licences
// ("GPL-2.0-or-later" or "-only" where a text says so, "GPL-2.0" for the bare licence, which does not say; likewise
// LGPL and AGPL), MIT, Apache-2.0, BSD-2-Clause and BSD-3-Clause. "" when there is none.
std::string SpdxIdentifier(std::string_view text);

// Whether a text speaks of CC-BY without a version: pictures that were added to a model under CC0, for example.
bool MentionsAttribution(std::string_view text);

}  // namespace anchorsplat

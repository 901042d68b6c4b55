#pragma once

#include <string>
#include <string_view>

namespace anchorsplat {

// SPDX identifier of the first licence that a text (plain or HTML) names, by its address, usual names or opening words:
// Creative Commons ("CC0-1.0", "CC-BY-3.0", "CC-BY-3.0-US", "CC-BY-SA-4.0" …), GNU ("GPL-2.0-or-later" or "-only" if
// stated, "GPL-2.0" for the bare licence; likewise LGPL and AGPL), MIT, Apache-2.0, BSD-2-Clause, BSD-3-Clause. "" if
// none.
std::string SpdxIdentifier(std::string_view text);

// Whether a text mentions CC-BY without a version, as for pictures added to a model under CC0.
bool MentionsAttribution(std::string_view text);

}  // namespace anchorsplat

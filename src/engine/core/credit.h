#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace anchorsplat {

// Whose a splat is and under which licence, as its comments say (GaussianCloud::comments): those that begin with
// "credit: ", without it. Licences such as CC BY ask for it wherever the splat is shown, so pages and pictures that we
// make of a splat carry it, and so do the formats that have a place for it (SplatFormat::comments).
std::vector<std::string> CreditsOf(std::span<const std::string> comments);

// The credits as one text, a line each, for formats that have one member for whose a file is. Empty: there are none.
std::string CopyrightOf(std::span<const std::string> comments);
// The comments that say what such a text says, a credit for each of its lines that is not blank.
std::vector<std::string> CommentsOfCopyright(std::string_view copyright);

}  // namespace anchorsplat

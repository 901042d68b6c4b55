#pragma once

#include <string>
#include <vector>

namespace anchorsplat {

// Whose a splat is and under which licence, as its comments say (GaussianCloud::comments): those that begin with
// "credit: ", without it. Licences such as CC BY ask for it wherever the splat is shown, so pages and pictures that we
// make of a splat carry it. PLY and compressed PLY keep comments; the other formats have no place for them.
std::vector<std::string> CreditsOf(const std::vector<std::string>& comments);

}  // namespace anchorsplat

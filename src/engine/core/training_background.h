#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace anchorsplat {

// The background that a splat was trained over, rgb 0–1, as a comment of its file ("trained over: 1 1 1"): fits write
// it where it is not black. Refinement and cleaning look there when neither the command nor the cameras' file says.
std::string BackgroundComment(const std::array<float, 3>& background);

// Of the first such comment whose three numbers lie in 0–1; nothing where there is none.
std::optional<std::array<float, 3>> BackgroundOf(const std::vector<std::string>& comments);

}  // namespace anchorsplat

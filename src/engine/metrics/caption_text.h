#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/image.h"

namespace anchorsplat {

// Captions on pictures: the letters of stb_easy_font, capitals seven pixels high, each pixel drawn as a square of
// `scale`; g, j, p, q and y reach two pixels below. Printable ASCII; any other byte is drawn as '?'.
inline constexpr int kCapitalHeight = 7;

int TextWidth(const std::string& text, int scale);  // pixels

// As much of the beginning of `text` as `width` pixels hold, followed by `ending` where something was cut off.
std::string FittingText(const std::string& text, int width, int scale, const std::string& ending = "...");

// All of it, in lines of at most `width` pixels, broken between words; a word that is wider by itself is cut into
// pieces.
std::vector<std::string> WrappedText(const std::string& text, int width, int scale);

// Draws with the upper left corner at (x, y) in `colour`; pixels outside of the image are left out.
void DrawText(Image& image, int x, int y, const std::string& text, int scale, const std::array<float, 3>& colour);

}  // namespace anchorsplat

#pragma once

#include <array>
#include <string>

#include "core/image.h"

namespace anchorsplat {

// Captions on pictures without a font library: glyphs of 5 x 7 pixels, six apart, each pixel drawn as a square of
// `scale`; g, j, p, q and y reach two pixels below. Printable ASCII for the most part; any other byte is a box.
inline constexpr int kGlyphCellWidth = 6;
inline constexpr int kGlyphHeight = 7;

int TextWidth(const std::string& text, int scale);  // pixels

// Draws with the upper left corner at (x, y) in `colour`; pixels outside of the image are left out.
void DrawText(Image& image, int x, int y, const std::string& text, int scale, const std::array<float, 3>& colour);

}  // namespace anchorsplat

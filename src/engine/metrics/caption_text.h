#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/image.h"

namespace anchorsplat {

// Captions in the font of stb_easy_font: capitals are seven font pixels high, each drawn as a square of `scale` pixels;
// g, j, p, q and y reach two below the baseline. Printable ASCII; other bytes are drawn as '?'.
inline constexpr int kCapitalHeight = 7;

int TextWidth(const std::string& text, int scale);  // pixels

// The longest prefix of `text` that fits into `width` pixels, followed by `ending` if truncated.
std::string TruncatedText(const std::string& text, int width, int scale, const std::string& ending = "...");

// Wraps `text` into lines of at most `width` pixels between words; a word wider than that is split.
std::vector<std::string> WrappedText(const std::string& text, int width, int scale);

// Draws text with its upper left corner at (x, y); clips at the image border.
void DrawText(Image& image, int x, int y, const std::string& text, int scale, const std::array<float, 3>& colour);

}  // namespace anchorsplat

#include "metrics/caption_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

// It uses ceil without including its header.
#include <stb/stb_easy_font.h>

namespace anchorsplat {

namespace {

// Replaces characters that the font lacks.
std::string Printed(std::string text) {
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text;
}

struct Corner {
  float x, y, z;
  unsigned char colour[4];
};
using Box = std::array<Corner, 4>;  // clockwise from the upper left

// Glyphs as boxes in font pixels, upper left corner at (0, 0).
std::vector<Box> Letters(std::string text) {
  constexpr size_t kMostBoxes = 24;  // per letter; the font's maximum is lower
  std::vector<Box> boxes(kMostBoxes * text.size());
  const int count =
      stb_easy_font_print(0, 0, text.data(), nullptr, boxes.data(), static_cast<int>(boxes.size() * sizeof(Box)));
  boxes.resize(static_cast<size_t>(count));
  return boxes;
}

}  // namespace

int TextWidth(const std::string& text, int scale) {
  if (text.empty()) return 0;
  return (stb_easy_font_width(Printed(text).data()) - 1) * scale;  // without the gap after the last letter
}

std::string TruncatedText(const std::string& text, int width, int scale, const std::string& ending) {
  if (TextWidth(text, scale) <= width) return text;
  std::string cut = text;
  while (!cut.empty() && TextWidth(cut + ending, scale) > width) cut.pop_back();
  return cut + ending;
}

std::vector<std::string> WrappedText(const std::string& text, int width, int scale) {
  std::vector<std::string> lines(1);
  const auto fits = [&](const std::string& line) { return TextWidth(line, scale) <= width; };
  std::string word;
  const auto end_word = [&] {
    if (word.empty()) return;
    std::string& line = lines.back();
    if (const std::string longer = line.empty() ? word : line + " " + word; fits(longer)) {
      line = longer;
    } else {
      if (!line.empty()) lines.emplace_back();
      for (const char c : word) {
        if (!lines.back().empty() && !fits(lines.back() + c)) lines.emplace_back();
        lines.back() += c;
      }
    }
    word.clear();
  };
  for (const char c : text) {
    if (c == ' ') {
      end_word();
    } else {
      word += c;
    }
  }
  end_word();
  if (lines.back().empty()) lines.pop_back();
  return lines;
}

void DrawText(Image& image, int x, int y, const std::string& text, int scale, const std::array<float, 3>& colour) {
  for (const Box& box : Letters(Printed(text))) {
    const auto [x0, x1] = std::pair(x + static_cast<int>(box[0].x) * scale, x + static_cast<int>(box[2].x) * scale);
    const auto [y0, y1] = std::pair(y + static_cast<int>(box[0].y) * scale, y + static_cast<int>(box[2].y) * scale);
    for (int v = std::max(0, y0); v < std::min(image.height, y1); ++v) {
      for (int u = std::max(0, x0); u < std::min(image.width, x1); ++u) {
        for (int c = 0; c < std::min(image.channels, 3); ++c) image.at(c, v, u) = colour[static_cast<size_t>(c)];
      }
    }
  }
}

}  // namespace anchorsplat

#include "dataset/room_pictures.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/image.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/text.h"
#include "metrics/caption_text.h"

namespace anchorsplat {

namespace {

using Paint = std::array<float, 3>;  // 0–1

Paint Blend(const Paint& a, const Paint& b, float t) {
  Paint out;
  for (size_t k = 0; k < 3; ++k) out[k] = a[k] + (b[k] - a[k]) * t;
  return out;
}

Paint Shade(const Paint& a, float by) { return {a[0] * by, a[1] * by, a[2] * by}; }

float Step(float edge, float soft, float x) { return std::clamp((x - edge) / soft + 0.5f, 0.0f, 1.0f); }

// Smooth random values, periodic after `across` and `along` cells.
class Grain {
 public:
  Grain(int across, int along, uint64_t seed)
      : across_(across), along_(along), values_(static_cast<size_t>(across) * static_cast<size_t>(along)) {
    Random random(seed);
    for (float& x : values_) x = static_cast<float>(random.Uniform());
  }
  float At(float s, float t) const {  // any s, t; period 1
    const float x = (s - std::floor(s)) * static_cast<float>(across_);
    const float y = (t - std::floor(t)) * static_cast<float>(along_);
    const int i = static_cast<int>(x), j = static_cast<int>(y);
    const float a = Smooth(x - static_cast<float>(i)), b = Smooth(y - static_cast<float>(j));
    const float low = Of(i, j) + (Of(i + 1, j) - Of(i, j)) * a;
    const float high = Of(i, j + 1) + (Of(i + 1, j + 1) - Of(i, j + 1)) * a;
    return low + (high - low) * b;
  }

 private:
  static float Smooth(float x) { return x * x * (3 - 2 * x); }
  float Of(int i, int j) const { return values_[static_cast<size_t>((j % along_) * across_ + i % across_)]; }

  int across_, along_;
  std::vector<float> values_;
};

// Paints a picture by a function of s (rightwards) and t (upwards), 0–1.
template <typename Function>
Texture Painted(const std::string& name, int width, int height, Function&& paint) {
  Texture texture;
  texture.name = name;
  texture.width = width;
  texture.height = height;
  texture.rgba.resize(size_t{4} * static_cast<size_t>(width) * static_cast<size_t>(height));
  ParallelFor(0, height, 16, [&](int64_t first, int64_t last) {
    for (int64_t y = first; y < last; ++y) {
      for (int x = 0; x < width; ++x) {
        const Paint color = paint((static_cast<float>(x) + 0.5f) / static_cast<float>(width),
                                  1 - (static_cast<float>(y) + 0.5f) / static_cast<float>(height));
        uint8_t* texel = texture.rgba.data() + 4 * (y * width + x);
        for (size_t k = 0; k < 3; ++k) {
          texel[k] = static_cast<uint8_t>(std::lround(std::clamp(color[k], 0.0f, 1.0f) * 255.0f));
        }
        texel[3] = 255;
      }
    }
  });
  return texture;
}

Texture FromImage(const std::string& name, const Image& image) {
  return Painted(name, image.width, image.height, [&](float s, float t) {
    const int x = static_cast<int>(s * static_cast<float>(image.width));
    const int y = static_cast<int>((1 - t) * static_cast<float>(image.height));
    return Paint{image.at(0, y, x), image.at(1, y, x), image.at(2, y, x)};
  });
}

Image Sheet(int width, int height, const Paint& color) {
  Image image(width, height, 3);
  for (int c = 0; c < 3; ++c) std::fill_n(image.channel(c), image.plane(), color[static_cast<size_t>(c)]);
  return image;
}

}  // namespace

Texture WoodFloorPicture(uint64_t seed) {
  constexpr int kRows = 16, kLengths = 2;  // planks of 15 cm by 1.2 m
  const Grain tone(kRows, 8, seed), fibre(24, 1024, seed + 1), fine(96, 2048, seed + 2), waves(6, 64, seed + 3);
  return Painted("wood floor", 2048, 2048, [&](float s, float t) {
    const float row = std::floor(t * kRows), within = t * kRows - row;
    // Rows are offset against each other.
    const float shift = static_cast<float>((static_cast<int>(row) * 7) % kRows) / kRows;
    const float along = (s + shift) * kLengths, plank = std::floor(along), end = along - plank;
    const float own = tone.At((row + 0.5f) / kRows, (std::fmod(plank, 2.0f) * 4 + 0.5f) / 8);
    const float ring = std::sin(60 * (waves.At(s + shift, t) + 0.35f * within) + 9 * own);
    const float grain = 0.5f * fibre.At(s, t) + 0.3f * fine.At(s, t) + 0.1f * (ring + 1);
    Paint color = Blend({0.36f, 0.21f, 0.11f}, {0.80f, 0.58f, 0.36f}, 0.25f + 0.35f * own + 0.45f * (grain - 0.3f));
    const float gap = std::min(std::min(within, 1 - within) / kRows, std::min(end, 1 - end) / kLengths);
    return gap < 0.0008f ? Shade(color, 0.25f) : color;
  });
}

Texture WallpaperPicture(uint64_t seed) {
  const Grain paper(256, 256, seed), spots(32, 32, seed + 1);
  return Painted("wallpaper", 1024, 1024, [&](float s, float t) {
    const float stripe = s * 8 - std::floor(s * 8);
    Paint color = stripe < 0.5f ? Paint{0.86f, 0.82f, 0.70f} : Paint{0.72f, 0.77f, 0.68f};
    // Hairlines beside each stripe, 1 mm wide.
    if (std::min({std::abs(stripe - 0.04f), std::abs(stripe - 0.46f)}) < 0.008f) color = {0.55f, 0.40f, 0.25f};
    // Rosettes in every cell of 12.5 cm, offset by half a cell in every second row.
    const float row = std::floor(t * 4), shift = static_cast<int>(row) % 2 == 0 ? 0.0f : 0.5f;
    const float x = s * 4 + shift - std::floor(s * 4 + shift) - 0.5f, y = t * 4 - row - 0.5f;
    const float radius = std::hypot(x, y), angle = std::atan2(y, x);
    const float petal = 0.17f + 0.07f * std::cos(8 * angle);
    if (radius < petal) color = Blend({0.62f, 0.25f, 0.22f}, {0.85f, 0.55f, 0.40f}, radius / petal);
    if (std::abs(radius - petal) < 0.012f) color = {0.30f, 0.16f, 0.12f};
    if (radius < 0.05f) color = {0.92f, 0.80f, 0.35f};
    // Fine print between them: dots of 1.5 mm every 8 mm.
    const float u = s * 64 - std::floor(s * 64) - 0.5f, v = t * 64 - std::floor(t * 64) - 0.5f;
    if (radius > 0.32f && std::hypot(u, v) < 0.1f + 0.1f * spots.At(s, t)) color = {0.25f, 0.35f, 0.45f};
    return Shade(color, 0.94f + 0.06f * paper.At(s, t));
  });
}

Texture PlasterPicture(uint64_t seed) {
  const Grain coarse(24, 24, seed), fine(256, 256, seed + 1);
  return Painted("plaster", 512, 512, [&](float s, float t) {
    return Shade({0.95f, 0.94f, 0.90f}, 0.86f + 0.07f * coarse.At(s, t) + 0.07f * fine.At(s, t));
  });
}

Texture RugPicture(uint64_t seed) {
  const Grain wool(512, 341, seed), worn(12, 8, seed + 1);
  return Painted("rug", 2048, 1365, [&](float s, float t) {
    const float x = 2.4f * s, y = 1.6f * t;  // metres
    const float border = std::min({x, y, 2.4f - x, 1.6f - y});
    Paint color = {0.55f, 0.12f, 0.14f};
    if (border < 0.20f) {
      color = {0.13f, 0.16f, 0.34f};
      const float along = border == std::min(y, 1.6f - y) ? x : y;
      const float u = along / 0.1f - std::floor(along / 0.1f) - 0.5f, v = (border - 0.1f) / 0.1f;
      if (std::abs(u) + std::abs(v) < 0.42f) color = {0.85f, 0.72f, 0.45f};
      if (std::abs(u) + std::abs(v) < 0.2f) color = {0.60f, 0.15f, 0.15f};
      if (std::abs(border - 0.19f) < 0.004f || std::abs(border - 0.02f) < 0.004f) color = {0.90f, 0.85f, 0.70f};
    } else {
      // Nested lozenges around the centre, and small ones all over.
      const float far = std::abs(x - 1.2f) / 1.0f + std::abs(y - 0.8f) / 0.6f;
      const int band = static_cast<int>(far * 14);
      if (far < 1 && band % 3 == 0) color = {0.88f, 0.74f, 0.48f};
      if (far < 1 && band % 3 == 1) color = {0.15f, 0.22f, 0.40f};
      const float u = x / 0.05f - std::floor(x / 0.05f) - 0.5f, v = y / 0.05f - std::floor(y / 0.05f) - 0.5f;
      if (std::abs(u) + std::abs(v) < 0.22f) color = Blend(color, {0.95f, 0.90f, 0.75f}, 0.8f);
    }
    const float knot = 0.85f + 0.15f * std::sin(x * 2 * std::numbers::pi_v<float> / 0.006f) *
                                   std::sin(y * 2 * std::numbers::pi_v<float> / 0.006f);
    return Shade(color, knot * (0.75f + 0.3f * wool.At(s, t)) * (0.9f + 0.1f * worn.At(s, t)));
  });
}

Texture LandscapePicture(uint64_t seed) {
  const Grain ridge(9, 2, seed), crest(24, 2, seed + 1), stroke(220, 60, seed + 2), leaf(300, 200, seed + 3);
  return Painted("landscape", 1536, 1048, [&](float s, float t) {
    const float brush = 0.9f + 0.2f * stroke.At(s, t);
    Paint color = Blend({0.95f, 0.80f, 0.60f}, {0.35f, 0.52f, 0.78f}, std::clamp(2 * t - 0.9f, 0.0f, 1.0f));
    if (std::hypot((s - 0.72f) * 1.47f, t - 0.74f) < 0.06f) color = {1.0f, 0.95f, 0.75f};
    if (t < 0.45f + 0.2f * ridge.At(s, 0.1f)) color = {0.45f, 0.47f, 0.62f};
    if (t < 0.33f + 0.14f * crest.At(s, 0.2f))
      color = Blend({0.20f, 0.36f, 0.20f}, {0.45f, 0.55f, 0.25f}, leaf.At(s, t));
    if (t < 0.26f) {
      color = Blend({0.20f, 0.33f, 0.48f}, {0.80f, 0.78f, 0.70f},
                    Step(0.72f, 0.2f, leaf.At(2 * s, 0.25f * t) + 0.4f * stroke.At(s, 3 * t)));
    }
    // Sails on the water.
    for (const auto& [x, y, size] : {Paint{0.25f, 0.17f, 0.10f}, {0.42f, 0.22f, 0.05f}, {0.58f, 0.12f, 0.13f}}) {
      const float u = (s - x) * 1.47f / size, v = (t - y) / size;
      if (v > 0 && v < 1 && u > -0.4f * (1 - v) && u < 0.5f * (1 - v)) color = {0.95f, 0.93f, 0.88f};
      if (v > -0.15f && v < 0 && std::abs(u) < 0.5f + v) color = {0.30f, 0.16f, 0.10f};
    }
    return Shade(color, brush);
  });
}

Texture OutdoorsPicture(uint64_t seed) {
  const Grain cloud(10, 8, seed), puff(40, 32, seed + 1), hill(14, 2, seed + 2), leaf(400, 200, seed + 3);
  return Painted("outdoors", 2048, 1024, [&](float s, float t) {
    const float cover = Step(0.6f, 0.5f, 0.7f * cloud.At(s, t) + 0.3f * puff.At(s, t));
    Paint color = Blend(Blend({0.80f, 0.88f, 0.96f}, {0.42f, 0.62f, 0.92f}, t), {0.97f, 0.97f, 0.97f}, cover);
    if (t < 0.42f + 0.1f * hill.At(s, 0.3f)) color = Blend({0.35f, 0.50f, 0.38f}, {0.50f, 0.62f, 0.48f}, leaf.At(s, t));
    if (t < 0.36f) color = Blend({0.30f, 0.42f, 0.18f}, {0.50f, 0.62f, 0.28f}, leaf.At(2 * s, t));
    // A row of houses with windows.
    const float lot = s * 24, house = std::floor(lot), x = lot - house, kind = hill.At(house / 24 + 0.02f, 0.8f);
    const float top = 0.40f + 0.07f * kind, roof = top + 0.05f * (1 - 2 * std::abs(x - 0.5f));
    if (x > 0.08f && x < 0.92f && t > 0.33f && t < roof) {
      color = t > top ? Paint{0.55f, 0.25f, 0.18f} : Blend({0.90f, 0.85f, 0.75f}, {0.70f, 0.75f, 0.80f}, kind);
      const float u = x * 6 - std::floor(x * 6), v = (t - 0.33f) * 50 - std::floor((t - 0.33f) * 50);
      if (t < top && u > 0.25f && u < 0.75f && v > 0.25f && v < 0.8f) color = {0.20f, 0.25f, 0.32f};
    }
    return color;
  });
}

Texture CurtainPicture(uint64_t seed) {
  const Grain thread(512, 64, seed);
  return Painted("curtain", 512, 512, [&](float s, float t) {
    const float stripe = s * 5 - std::floor(s * 5);
    Paint color = stripe < 0.3f ? Paint{0.25f, 0.40f, 0.48f} : Paint{0.82f, 0.78f, 0.66f};
    if (std::abs(stripe - 0.65f) < 0.03f) color = {0.70f, 0.30f, 0.20f};
    const float weave =
        std::sin(t * 2 * std::numbers::pi_v<float> * 150) * std::sin(s * 2 * std::numbers::pi_v<float> * 150);
    return Shade(color, 0.85f + 0.1f * thread.At(s, t) + 0.05f * weave);
  });
}

Texture ReadingChartPicture() {
  Image image = Sheet(1400, 2000, {0.96f, 0.95f, 0.91f});
  const Paint ink = {0.08f, 0.08f, 0.10f};
  const std::string lines[] = {
      "E F P",
      "T O Z L",
      "L P E D Q",
      "P E C F D R",
      "E D F C Z P T",
      "F E L O P Z D B",
      "What is near shows more than what is far,",
      "and what was photographed from afar is soft when somebody",
      "comes closer. A picture has as much of a thing as its pixels could hold; no more.",
      "The smallest line of this chart has letters of three and a half millimetres, and then two."};
  const int scales[] = {28, 20, 15, 12, 9, 7, 5, 4, 3, 2};
  int y = 90;
  for (size_t i = 0; i < std::size(scales); ++i) {
    const int scale = scales[i];
    for (const std::string& text : WrappedText(lines[i], 1240, scale)) {
      DrawText(image, (image.width - TextWidth(text, scale)) / 2, y, text, scale, ink);
      y += 10 * scale;
    }
    y += 26 + 2 * scale;
  }
  // A column of the smallest letters, and lines with decreasing spacing.
  for (int row = 0; row < 12 && y < 1760; ++row, y += 12) {
    DrawText(image, 90, y,
             Cat("row ", row + 1, ": the quick brown fox jumps over the lazy dog, 0123456789, and on it goes"), 1, ink);
  }
  int x = 90;
  for (int width = 1; width < 13; ++width) {
    for (int bar = 0; bar < 6 && x + width < image.width - 90; ++bar, x += 2 * width) {
      for (int c = 0; c < 3; ++c) {
        for (int row = 1800; row < 1930; ++row) {
          std::fill_n(&image.at(c, row, x), width, ink[static_cast<size_t>(c)]);
        }
      }
    }
    x += 20;
  }
  return FromImage("reading chart", image);
}

Texture BookSpinesPicture(uint64_t seed) {
  constexpr int kLong = 1024, kThick = 64;  // of a spine, pixels
  const char* first[] = {"THE HISTORY OF", "A GUIDE TO", "NOTES ON",     "LECTURES ON", "ON",
                         "TRAVELS IN",     "ATLAS OF",   "LETTERS ABOUT"};
  const char* second[] = {"OPTICS",   "GARDENS", "BRIDGES", "THE STARS", "CLOCKS",  "RIVERS",
                          "PAINTING", "BREAD",   "SURVEY",  "THE NORTH", "NUMBERS", "BIRDS"};
  const char* authors[] = {"Adler", "Brook", "Castellan", "Dorn", "Ege", "Fenn", "Gray", "Holm", "Ivers"};
  Image atlas(kThick * kBookSpines / 2, 2 * kLong, 3);
  Random random(seed);
  for (int book = 0; book < kBookSpines; ++book) {
    Paint cloth, foil;
    for (float& x : cloth) x = static_cast<float>(random.Uniform(0.08, 0.7));
    const bool pale = cloth[0] + cloth[1] + cloth[2] > 1.1f;
    for (float& x : foil) x = static_cast<float>(pale ? random.Uniform(0.0, 0.2) : random.Uniform(0.7, 1));
    Image spine = Sheet(kLong, kThick, cloth);
    for (const int band : {40, 60, kLong - 70, kLong - 50}) {
      for (int c = 0; c < 3; ++c) {
        for (int y = 0; y < kThick; ++y) std::fill_n(&spine.at(c, y, band), 6, foil[static_cast<size_t>(c)]);
      }
    }
    const std::string title =
        Cat(first[random.Below(std::ssize(first))], " ", second[random.Below(std::ssize(second))]);
    const std::string author = authors[random.Below(std::ssize(authors))];
    const int scale = random.Below(2) == 0 ? 4 : 5;
    DrawText(spine, 100, (kThick - 7 * scale) / 2, TruncatedText(title, 580, scale), scale, foil);
    DrawText(spine, 720, (kThick - 21) / 2, author, 3, foil);
    const int column = book % (kBookSpines / 2) * kThick, row = book / (kBookSpines / 2) * kLong;
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < kThick; ++y) {
        // Text runs from top to bottom; spines are rounded, so darker towards the edges.
        const float round = 1 - 0.35f * std::pow(2 * (static_cast<float>(y) + 0.5f) / kThick - 1, 4.0f);
        for (int x = 0; x < kLong; ++x) atlas.at(c, row + x, column + kThick - 1 - y) = round * spine.at(c, y, x);
      }
    }
  }
  return FromImage("book spines", atlas);
}

}  // namespace anchorsplat

#include "dataset/backdrop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/random.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

using Color = std::array<float, 3>;  // 0–1

Color RandomColor(Random& random, double low, double high) {
  Color color;
  for (float& x : color) x = static_cast<float>(random.Uniform(low, high));
  return color;
}

Color Mix(const Color& a, const Color& b, float t) {
  Color out;
  for (size_t k = 0; k < 3; ++k) out[k] = a[k] + (b[k] - a[k]) * t;
  return out;
}

// Smooth random values on the unit square, on a grid of `cells` per side.
class ValueNoise {
 public:
  ValueNoise(int cells, Random& random) : cells_(cells), values_(static_cast<size_t>((cells + 1) * (cells + 1))) {
    for (float& x : values_) x = static_cast<float>(random.Uniform());
  }
  float At(float s, float t) const {  // s, t in [0,1)
    const float x = s * static_cast<float>(cells_), y = t * static_cast<float>(cells_);
    const int i = std::min(static_cast<int>(x), cells_ - 1), j = std::min(static_cast<int>(y), cells_ - 1);
    const float a = Smooth(x - static_cast<float>(i)), b = Smooth(y - static_cast<float>(j));
    const float below = Value(i, j) + (Value(i + 1, j) - Value(i, j)) * a;
    const float above = Value(i, j + 1) + (Value(i + 1, j + 1) - Value(i, j + 1)) * a;
    return below + (above - below) * b;
  }

 private:
  static float Smooth(float x) { return x * x * (3 - 2 * x); }
  float Value(int i, int j) const { return values_[static_cast<size_t>(j * (cells_ + 1) + i)]; }

  int cells_;
  std::vector<float> values_;
};

// A framed picture on the wall, on the unit square.
struct Poster {
  float s, t, width, height;
  Color frame, paper, ink;
  int pattern;  // 0 stripes, 1 checks, 2 rings
  float period;

  bool Holds(float x, float y) const { return x >= s && x < s + width && y >= t && y < t + height; }
  Color At(float x, float y) const {
    const float border = 0.008f, u = x - s, v = y - t;
    if (std::min({u, v, width - u, height - v}) < border) return frame;
    const auto odd = [&](float z) { return (static_cast<int>(std::floor(z / period)) & 1) != 0; };
    const bool inked = pattern == 0   ? odd(u + v)
                       : pattern == 1 ? odd(u) != odd(v)
                                      : odd(std::hypot(u - width / 2, v - height / 2));
    return inked ? ink : paper;
  }
};

Poster RandomPoster(Random& random) {
  Poster p;
  p.width = static_cast<float>(random.Uniform(0.06, 0.2));
  p.height = static_cast<float>(random.Uniform(0.06, 0.2));
  p.s = static_cast<float>(random.Uniform(0, 1 - static_cast<double>(p.width)));
  p.t = static_cast<float>(random.Uniform(0, 1 - static_cast<double>(p.height)));
  p.frame = RandomColor(random, 0, 0.3);
  p.paper = RandomColor(random, 0.5, 1);
  p.ink = RandomColor(random, 0, 0.8);
  p.pattern = static_cast<int>(random.Below(3));
  p.period = static_cast<float>(random.Uniform(0.004, 0.03));
  return p;
}

// Picture of one wall: its material and posters.
Texture WallPicture(uint64_t seed, int wall) {
  Random random(seed * 6 + static_cast<uint64_t>(wall));
  const Color dark = RandomColor(random, 0.15, 0.6), light = RandomColor(random, 0.5, 1);
  std::vector<std::pair<ValueNoise, float>> octaves;
  float weight = 0.5f;
  for (int cells = 4; cells <= 256; cells *= 2, weight *= 0.75f)
    octaves.emplace_back(ValueNoise(cells, random), weight);
  float sum = 0;
  for (const auto& octave : octaves) sum += octave.second;
  const float tiles = static_cast<float>(8 + random.Below(9));
  std::vector<Poster> posters;
  for (int i = 0; i < 16; ++i) posters.push_back(RandomPoster(random));

  Texture texture;
  texture.name = Cat("wall ", wall);
  texture.width = texture.height = kBackdropPixels;
  texture.rgba.resize(size_t{4} * kBackdropPixels * kBackdropPixels);
  for (int y = 0; y < kBackdropPixels; ++y) {
    for (int x = 0; x < kBackdropPixels; ++x) {
      const float s = (static_cast<float>(x) + 0.5f) / kBackdropPixels;
      const float t = (static_cast<float>(y) + 0.5f) / kBackdropPixels;
      float shade = 0;
      for (const auto& [noise, share] : octaves) shade += noise.At(s, t) * share / sum;
      // Sums of many random numbers stay near ½, so contrast is increased.
      Color color = Mix(dark, light, std::clamp(0.5f + 2.5f * (shade - 0.5f), 0.0f, 1.0f));
      const float u = s * tiles - std::floor(s * tiles), v = t * tiles - std::floor(t * tiles);
      if (std::min(u, v) < 0.05f) color = Mix(color, dark, 0.7f);
      for (const Poster& poster : posters) {
        if (poster.Holds(s, t)) color = poster.At(s, t);
      }
      uint8_t* texel = texture.rgba.data() + 4 * (static_cast<size_t>(y) * kBackdropPixels + static_cast<size_t>(x));
      for (size_t k = 0; k < 3; ++k) texel[k] = static_cast<uint8_t>(std::lround(color[k] * 255.0f));
      texel[3] = 255;
    }
  }
  return texture;
}

}  // namespace

Status AddBackdrop(Mesh& mesh, double half_side, uint64_t seed) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(mesh));
  if (!(half_side > 0 && std::isfinite(half_side))) {
    return Error{ErrorCode::kBadArgument, Cat("half side ", half_side, " of a room is not a positive length")};
  }
  const float half = static_cast<float>(half_side);
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t corner : triangle) {
      for (const float x : mesh.positions[corner]) {
        if (!(std::abs(x) < half)) {
          return Error{ErrorCode::kBadArgument, Cat("the object does not fit into a room of half side ", half_side)};
        }
      }
    }
  }
  mesh.uvs.resize(mesh.positions.size(), {0, 0});
  for (int wall = 0; wall < 6; ++wall) {
    const size_t axis = static_cast<size_t>(wall / 2);
    const float side = wall % 2 == 0 ? -half : half;
    const uint32_t first = static_cast<uint32_t>(mesh.positions.size());
    for (const auto& [s, t] : {std::array<float, 2>{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
      std::array<float, 3> corner;
      corner[axis] = side;
      corner[(axis + 1) % 3] = (2 * s - 1) * half;
      corner[(axis + 2) % 3] = (2 * t - 1) * half;
      mesh.positions.push_back(corner);
      mesh.uvs.push_back({s, t});
      if (!mesh.normals.empty()) mesh.normals.push_back({0, 0, 0});  // flat
      if (!mesh.colors.empty()) mesh.colors.push_back({1, 1, 1, 1});
    }
    Material material;
    material.name = Cat("wall ", wall);
    material.diffuse = {1, 1, 1};
    material.texture = static_cast<int>(mesh.textures.size());
    const int32_t number = static_cast<int32_t>(mesh.materials.size());
    mesh.textures.push_back(WallPicture(seed, wall));
    mesh.materials.push_back(std::move(material));
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
    mesh.triangle_materials.insert(mesh.triangle_materials.end(), {number, number});
  }
  return Validate(mesh);
}

}  // namespace anchorsplat

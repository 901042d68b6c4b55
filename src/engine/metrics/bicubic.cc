#include "metrics/bicubic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr size_t kTaps = 4;

// Source taps of one output pixel.
struct Taps {
  std::array<int, kTaps> at{};
  std::array<float, kTaps> weight{};
};

double Keys(double x) {
  constexpr double a = -0.5;
  x = std::abs(x);
  if (x < 1) return ((a + 2) * x - (a + 3)) * x * x + 1;
  if (x < 2) return ((a * x - 5 * a) * x + 8 * a) * x - 4 * a;
  return 0;
}

std::vector<Taps> MakeTaps(int from, int to) {
  std::vector<Taps> taps(static_cast<size_t>(to));
  for (int i = 0; i < to; ++i) {
    const double centre = (i + 0.5) * from / to - 0.5;
    const int first = static_cast<int>(std::floor(centre)) - 1;
    for (size_t k = 0; k < kTaps; ++k) {
      const int at = first + static_cast<int>(k);
      taps[static_cast<size_t>(i)].at[k] = std::clamp(at, 0, from - 1);
      taps[static_cast<size_t>(i)].weight[k] = static_cast<float>(Keys(centre - at));
    }
  }
  return taps;
}

}  // namespace

Result<Image> EnlargeBicubic(const Image& image, int width, int height) {
  if (image.width < 1 || image.height < 1 || image.channels < 1) {
    return Error{ErrorCode::kBadArgument, "an empty picture cannot be enlarged"};
  }
  if (width < image.width || height < image.height || width > kMaxImageSide || height > kMaxImageSide ||
      int64_t{width} * height > kMaxImagePixels) {
    return Error{ErrorCode::kBadArgument,
                 Cat("a picture of ", image.width, " x ", image.height, " cannot become ", width, " x ", height)};
  }
  const std::vector<Taps> columns = MakeTaps(image.width, width), rows = MakeTaps(image.height, height);
  Image wide(width, image.height, image.channels);
  ParallelFor(0, int64_t{image.channels} * image.height, 16, [&](int64_t first, int64_t last) {
    for (int64_t row = first; row < last; ++row) {
      const float* in = image.pixels.data() + row * image.width;
      float* out = wide.pixels.data() + row * width;
      for (int x = 0; x < width; ++x) {
        const Taps& t = columns[static_cast<size_t>(x)];
        out[x] = t.weight[0] * in[t.at[0]] + t.weight[1] * in[t.at[1]] + t.weight[2] * in[t.at[2]] +
                 t.weight[3] * in[t.at[3]];
      }
    }
  });
  Image result(width, height, image.channels);
  ParallelFor(0, int64_t{image.channels} * height, 16, [&](int64_t first, int64_t last) {
    for (int64_t row = first; row < last; ++row) {
      const Taps& t = rows[static_cast<size_t>(row % height)];
      const float* plane = wide.channel(static_cast<int>(row / height));
      const auto in = [&](size_t k) { return plane + int64_t{t.at[k]} * width; };
      const float *a = in(0), *b = in(1), *c = in(2), *d = in(3);
      float* out = result.pixels.data() + row * width;
      for (int x = 0; x < width; ++x) {
        out[x] = t.weight[0] * a[x] + t.weight[1] * b[x] + t.weight[2] * c[x] + t.weight[3] * d[x];
      }
    }
  });
  return result;
}

}  // namespace anchorsplat

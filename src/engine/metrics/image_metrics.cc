#include "metrics/image_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"
#include "metrics/ssim.h"

namespace anchorsplat {

namespace {

// Colour channels; alpha is ignored.
int ColourChannels(const Image& image) { return std::min(image.channels, 3); }

Status CheckComparable(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels) {
    return Error{ErrorCode::kBadArgument, Cat("images of ", a.width, " x ", a.height, " x ", a.channels, " and ",
                                              b.width, " x ", b.height, " x ", b.channels, " cannot be compared")};
  }
  if (a.width < 1 || a.height < 1 || a.channels < 1) {
    return Error{ErrorCode::kBadArgument, "empty images cannot be compared"};
  }
  return {};
}

// Independent partial sums that fit in registers: float squares over a short run, then doubles. The fixed order makes
// the result deterministic.
double SumOfSquaredDifferences(const float* a, const float* b, int64_t count) {
  constexpr int64_t kRun = 256;
  constexpr int64_t kLanes = 16;
  double total = 0;
  for (int64_t begin = 0; begin < count; begin += kRun) {
    const int64_t end = std::min(count, begin + kRun);
    float lanes[kLanes] = {};
    int64_t i = begin;
    for (; i + kLanes <= end; i += kLanes) {
      for (int64_t k = 0; k < kLanes; ++k) {
        const float difference = a[i + k] - b[i + k];
        lanes[k] += difference * difference;
      }
    }
    for (; i < end; ++i) lanes[0] += (a[i] - b[i]) * (a[i] - b[i]);
    for (const float lane : lanes) total += static_cast<double>(lane);
  }
  return total;
}

}  // namespace

namespace {

double SumOfSquares(const Image& a, const Image& b) {
  const int64_t count = a.plane() * ColourChannels(a);
  constexpr int64_t kGrain = int64_t{1} << 16;
  std::vector<double> sums(static_cast<size_t>((count + kGrain - 1) / kGrain));
  ParallelFor(0, count, kGrain, [&](int64_t begin, int64_t end) {
    sums[static_cast<size_t>(begin / kGrain)] =
        SumOfSquaredDifferences(a.pixels.data() + begin, b.pixels.data() + begin, end - begin);
  });
  double sum = 0;
  for (const double part : sums) sum += part;
  return sum;
}

double SumOfDissimilarities(const Image& a, const Image& b, const uint8_t* ignored) {
  // A chunk is a band of rows of one channel.
  constexpr int64_t kRows = 32;
  const int64_t bands = (a.height + kRows - 1) / kRows;
  const int channels = ColourChannels(a);
  std::vector<double> sums(static_cast<size_t>(bands * channels));
  ParallelFor(0, bands * channels, 1, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      const int channel = static_cast<int>(k / bands);
      const int first = static_cast<int>(k % bands * kRows);
      const int last = std::min(a.height, first + static_cast<int>(kRows));
      sums[static_cast<size_t>(k)] =
          SumOfDissimilarity({a.channel(channel), b.channel(channel), a.width, a.height, first, last, ignored});
    }
  });
  double sum = 0;
  for (const double part : sums) sum += part;
  return sum;
}

double PsnrOf(double squares, int64_t values) {
  if (squares == 0) return std::numeric_limits<double>::infinity();
  return -10 * std::log10(squares / static_cast<double>(values));
}

}  // namespace

Result<double> Psnr(const Image& a, const Image& b) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckComparable(a, b));
  return PsnrOf(SumOfSquares(a, b), a.plane() * ColourChannels(a));
}

Result<double> Ssim(const Image& a, const Image& b) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckComparable(a, b));
  return 1 - SumOfDissimilarities(a, b, nullptr) / static_cast<double>(a.plane() * ColourChannels(a));
}

Result<MaskedQuality> MeasureMasked(const Image& a, const Image& b, std::span<const uint8_t> ignored) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckComparable(a, b));
  if (!ignored.empty() && std::ssize(ignored) != a.plane()) {
    return Error{ErrorCode::kBadArgument,
                 Cat("a mask of ", ignored.size(), " pixels for images of ", a.width, " x ", a.height)};
  }
  MaskedQuality quality;
  quality.counted = a.plane() - std::ranges::count_if(ignored, [](uint8_t x) { return x != 0; });
  if (quality.counted == 0) return quality;
  const int64_t values = quality.counted * ColourChannels(a);
  quality.psnr = PsnrOf(SumOfSquares(a, b), values);
  quality.ssim =
      1 - SumOfDissimilarities(a, b, ignored.empty() ? nullptr : ignored.data()) / static_cast<double>(values);
  return quality;
}

std::string WhollyMasked(std::span<const std::string> names, int64_t count) {
  constexpr size_t kShown = 10;
  std::string text = Cat("masks hide every pixel of ", names.size(), " of ", count,
                         " views, which are skipped (black hides a pixel, white uses it): ");
  for (size_t i = 0; i < std::min(kShown, names.size()); ++i) text += Cat(i == 0 ? "" : ", ", Printable(names[i]));
  if (names.size() > kShown) text += Cat(" and ", names.size() - kShown, " more");
  return text;
}

void Clamp01(Image& image) {
  ParallelFor(0, static_cast<int64_t>(image.pixels.size()), int64_t{1} << 16, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      float& value = image.pixels[static_cast<size_t>(i)];
      value = std::max(0.0f, std::min(1.0f, value));
    }
  });
}

void FillIgnored(const Buffer<uint8_t>& ignored, const Image& shown, Image& picture) {
  for (size_t i = 0; i < ignored.size(); ++i) {
    if (ignored[i] == 0) continue;
    for (int c = 0; c < picture.channels; ++c) picture.channel(c)[i] = shown.channel(c)[i];
  }
}

}  // namespace anchorsplat

#include "metrics/image_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"
#include "metrics/ssim.h"

namespace anchorsplat {

namespace {

// Colour channels that count: alpha does not.
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

// Independent partial sums, so that the compiler may keep them in one register each: float squares of one short run,
// then doubles. The order is fixed, so the result is too.
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

Result<double> Psnr(const Image& a, const Image& b) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckComparable(a, b));
  const int64_t count = a.plane() * ColourChannels(a);
  constexpr int64_t kGrain = int64_t{1} << 16;
  std::vector<double> sums(static_cast<size_t>((count + kGrain - 1) / kGrain));
  ParallelFor(0, count, kGrain, [&](int64_t begin, int64_t end) {
    sums[static_cast<size_t>(begin / kGrain)] =
        SumOfSquaredDifferences(a.pixels.data() + begin, b.pixels.data() + begin, end - begin);
  });
  double sum = 0;
  for (const double part : sums) sum += part;
  if (sum == 0) return std::numeric_limits<double>::infinity();
  return -10 * std::log10(sum / static_cast<double>(count));
}

Result<double> Ssim(const Image& a, const Image& b) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckComparable(a, b));
  // A chunk is a band of rows of one channel; bands never straddle channels.
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
          SumOfDissimilarity({a.channel(channel), b.channel(channel), a.width, a.height, first, last});
    }
  });
  double sum = 0;
  for (const double part : sums) sum += part;
  return 1 - sum / static_cast<double>(a.plane() * channels);
}

void Clamp01(Image& image) {
  ParallelFor(0, static_cast<int64_t>(image.pixels.size()), int64_t{1} << 16, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      float& value = image.pixels[static_cast<size_t>(i)];
      value = std::max(0.0f, std::min(1.0f, value));
    }
  });
}

}  // namespace anchorsplat

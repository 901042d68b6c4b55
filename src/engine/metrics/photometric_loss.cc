#include "metrics/photometric_loss.h"

#include <algorithm>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"
#include "metrics/ssim.h"
#include "metrics/ssim_gradient.h"

namespace anchorsplat {

namespace {

constexpr int kChannels = 3;
constexpr int kRowsPerBand = 64;  // rows per task of the comparison

// Gradient rows per task. Each needs twenty more rows of the images, so large images have large tasks; small images
// need small ones to occupy all threads.
constexpr int RowsPerTask(int rows) { return rows > 512 ? 128 : 64; }

Error BadArgument(std::string message) { return {ErrorCode::kBadArgument, std::move(message)}; }

Status Check(const Image& rendered, const Image& target, const PhotometricLossOptions& options) {
  if (rendered.width != target.width || rendered.height != target.height || rendered.channels != kChannels ||
      target.channels != kChannels) {
    return BadArgument(Cat("images of ", rendered.width, " x ", rendered.height, " x ", rendered.channels, " and ",
                           target.width, " x ", target.height, " x ", target.channels,
                           "; the photometric loss compares two of the same size and three channels"));
  }
  return CheckPhotometricLoss(rendered.width, rendered.height, options);
}

// Index of the first difference in n numbers, n if there is none. NaN differs.
int FirstDifference(const float* p, const float* q, int n) {
  constexpr int kRun = 32;  // compared without branches
  int i = 0;
  for (; i + kRun <= n; i += kRun) {
    unsigned differ = 0;
    for (int k = 0; k < kRun; ++k) differ |= static_cast<unsigned>(p[i + k] != q[i + k]);
    if (differ != 0) break;
  }
  while (i < n && p[i] == q[i]) ++i;
  return i;
}

// 1 + index of the last difference in [from, n), `from` if there is none.
int EndOfDifference(const float* p, const float* q, int from, int n) {
  constexpr int kRun = 32;
  for (; n - kRun >= from; n -= kRun) {
    unsigned differ = 0;
    for (int k = 1; k <= kRun; ++k) differ |= static_cast<unsigned>(p[n - k] != q[n - k]);
    if (differ != 0) break;
  }
  while (n > from && p[n - 1] == q[n - 1]) --n;
  return n;
}

// Bounding box of the differing pixels in rows [first, last).
PixelBox BoxOfDifference(const Image& a, const Image& b, int first, int last) {
  PixelBox box = {a.width, last, 0, first};
  for (int c = 0; c < kChannels; ++c) {
    for (int y = first; y < last; ++y) {
      const float* p = a.channel(c) + int64_t{y} * a.width;
      const float* q = b.channel(c) + int64_t{y} * b.width;
      const int from = FirstDifference(p, q, a.width);
      if (from == a.width) continue;
      box.x0 = std::min(box.x0, from);
      box.x1 = EndOfDifference(p, q, std::max(box.x1, from + 1), a.width);  // columns before are already inside
      box.y0 = std::min(box.y0, y);
      box.y1 = std::max(box.y1, y + 1);
    }
  }
  return box;
}

PixelBox Grown(const PixelBox& box, int by) { return {box.x0 - by, box.y0 - by, box.x1 + by, box.y1 + by}; }
PixelBox Common(const PixelBox& a, const PixelBox& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

}  // namespace

Status CheckPhotometricLoss(int width, int height, const PhotometricLossOptions& options) {
  if (width < 1 || height < 1) return BadArgument("empty images cannot be compared");
  if (!(options.ssim_weight >= 0 && options.ssim_weight <= 1)) {
    return BadArgument(Cat("SSIM weight ", options.ssim_weight, " is not in [0, 1]"));
  }
  if (options.padding == SsimPadding::kValid && options.ssim_weight > 0 && std::min(width, height) < kSsimTaps) {
    return BadArgument(
        Cat("images of ", width, " x ", height, " have no pixel whose SSIM window of 11 x 11 lies inside"));
  }
  return {};
}

Result<PhotometricLossValue> PhotometricLoss(const Image& rendered, const Image& target,
                                             const PhotometricLossOptions& options, Image& gradient, PixelBox& box) {
  ANCHORSPLAT_RETURN_IF_ERROR(Check(rendered, target, options));
  const int width = rendered.width, height = rendered.height;
  const PixelBox picture = {0, 0, width, height};
  if (gradient.width != width || gradient.height != height || gradient.channels != kChannels) {
    gradient = Image(width, height, kChannels);
  }

  const int bands = (height + kRowsPerBand - 1) / kRowsPerBand;
  std::vector<PixelBox> boxes(static_cast<size_t>(bands));
  ParallelFor(0, height, kRowsPerBand, [&](int64_t first, int64_t last) {
    boxes[static_cast<size_t>(first / kRowsPerBand)] =
        BoxOfDifference(rendered, target, static_cast<int>(first), static_cast<int>(last));
  });
  PixelBox different = {width, height, 0, 0};
  for (const PixelBox& b : boxes) {
    if (b.empty()) continue;
    different = {std::min(different.x0, b.x0), std::min(different.y0, b.y0), std::max(different.x1, b.x1),
                 std::max(different.y1, b.y1)};
  }
  if (different.empty()) {
    box = {};
    return PhotometricLossValue{};
  }

  // SSIM differs from 1 if a pixel's window contains a difference; the gradient of a pixel comes from all windows that
  // contain it.
  const bool valid = options.padding == SsimPadding::kValid;
  const PixelBox counted = valid ? Grown(picture, -kSsimRadius) : picture;
  const PixelBox map = options.ssim_weight > 0 ? Common(Grown(different, kSsimRadius), counted) : PixelBox{};
  box = options.ssim_weight > 0 ? Common(Grown(different, 2 * kSsimRadius), picture) : different;
  const double values = kChannels * static_cast<double>(rendered.plane());
  const double windows = kChannels * static_cast<double>(counted.x1 - counted.x0) * (counted.y1 - counted.y0);

  // Strips of similar width, in whole registers.
  const int strips = (box.x1 - box.x0 + kSsimStrip - 1) / kSsimStrip;
  const int strip_width = ((box.x1 - box.x0 + strips - 1) / strips + 15) / 16 * 16;
  const int rows_per_task = RowsPerTask(box.y1 - box.y0);
  const int rows = (box.y1 - box.y0 + rows_per_task - 1) / rows_per_task;
  const int64_t tasks = int64_t{kChannels} * rows * strips;
  std::vector<SsimGradientSums> parts(static_cast<size_t>(tasks));
  ParallelFor(0, tasks, 1, [&](int64_t k, int64_t) {
    const int channel = static_cast<int>(k % kChannels);
    const int strip = static_cast<int>(k / kChannels % strips), row = static_cast<int>(k / kChannels / strips);
    SsimGradientTask task{};
    task.a = rendered.channel(channel);
    task.b = target.channel(channel);
    task.width = width;
    task.height = height;
    task.map = map;
    task.out.x0 = std::min(box.x1, box.x0 + strip * strip_width);
    task.out.x1 = std::min(box.x1, task.out.x0 + strip_width);
    task.out.y0 = box.y0 + row * rows_per_task;
    task.out.y1 = std::min(box.y1, task.out.y0 + rows_per_task);
    task.ssim_weight = options.ssim_weight > 0 ? static_cast<float>(-options.ssim_weight / windows) : 0.0f;
    task.difference_weight = static_cast<float>((1 - options.ssim_weight) / values);
    task.gradient = gradient.channel(channel);
    parts[static_cast<size_t>(k)] = SsimGradient(task);
  });
  SsimGradientSums sums;
  for (const SsimGradientSums& part : parts) {
    sums.dissimilarity += part.dissimilarity;
    sums.difference += part.difference;
  }
  PhotometricLossValue value;
  value.l1 = sums.difference / values;
  value.ssim = options.ssim_weight > 0 ? 1 - sums.dissimilarity / windows : 1;
  value.loss = (1 - options.ssim_weight) * value.l1 + options.ssim_weight * (1 - value.ssim);
  return value;
}

}  // namespace anchorsplat

#include "enhance/showing_gaussians.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/activations.h"
#include "core/framing.h"
#include "core/spherical_harmonics.h"

namespace anchorsplat {

namespace {

constexpr float kVisible = 0.1f;   // opacity
constexpr float kBlack = 0.04f;    // brightest channel of the constant colour; ten steps of 255
constexpr double kFarthest = 1.5;  // of the radius that frames the cloud, as the estimate of the pixel looks
constexpr size_t kMost = 200'000;  // as it does
constexpr size_t kLeastBright = 16;

bool IsBlack(const GaussianCloud& cloud, int64_t i) {
  const float* sh = cloud.sh.data() + i * cloud.sh_stride();
  return 0.5f + kSh0 * std::max({sh[0], sh[1], sh[2]}) < kBlack;
}

// Rows of (distance², row).
std::vector<int64_t> Nearest(std::vector<std::pair<double, int64_t>> items) {
  if (items.size() > kMost) {
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(kMost), items.end());
    items.resize(kMost);
  }
  std::vector<int64_t> rows;
  rows.reserve(items.size());
  for (const auto& item : items) rows.push_back(item.second);
  std::sort(rows.begin(), rows.end());
  return rows;
}

}  // namespace

double SquaredDistance(const float* a, const float* b) {
  double sum = 0;
  for (size_t k = 0; k < 3; ++k) sum += (double{a[k]} - double{b[k]}) * (double{a[k]} - double{b[k]});
  return sum;
}

ShowingGaussians FindShowingGaussians(const GaussianCloud& cloud) {
  const Framing framing = FrameCloud(cloud);
  const std::array<float, 3> middle = {static_cast<float>(framing.target[0]), static_cast<float>(framing.target[1]),
                                       static_cast<float>(framing.target[2])};
  ShowingGaussians showing;
  std::vector<std::pair<double, int64_t>> bright, all;  // distance², row
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!IsUsable(cloud, i)) continue;
    const bool black = IsBlack(cloud, i);
    if (!black) showing.not_black.push_back(i);
    const float opacity = Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]);
    const double distance = SquaredDistance(cloud.means.data() + 3 * i, middle.data());
    if (opacity < kVisible || std::sqrt(distance) > kFarthest * framing.radius) continue;
    all.emplace_back(distance, i);
    if (!black) bright.emplace_back(distance, i);
  }
  showing.bright = Nearest(bright.size() >= kLeastBright ? bright : all);
  showing.all = Nearest(std::move(all));
  return showing;
}

}  // namespace anchorsplat

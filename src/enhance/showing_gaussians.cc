#include "enhance/showing_gaussians.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/activations.h"
#include "core/framing.h"
#include "core/run_context.h"
#include "core/spherical_harmonics.h"
#include "enhance/pixel_size_features.h"

namespace anchorsplat {

namespace {

constexpr float kNearlyBlack = 0.04f;  // brightest channel of the constant colour; ten steps of 255

bool IsBlack(const GaussianCloud& cloud, int64_t i) {
  const float* sh = cloud.sh.data() + i * cloud.sh_stride();
  return ColorFromDc(std::max({sh[0], sh[1], sh[2]})) < kNearlyBlack;
}

// Rows of (distance², row).
std::vector<int64_t> Nearest(std::vector<std::pair<double, int64_t>> items) {
  if (items.size() > kMostShowing) {
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(kMostShowing), items.end());
    items.resize(kMostShowing);
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
  LeaveIfAbandoned();
  const Framing framing = FrameCloud(cloud);
  LeaveIfAbandoned();
  const std::array<float, 3> middle = {static_cast<float>(framing.target[0]), static_cast<float>(framing.target[1]),
                                       static_cast<float>(framing.target[2])};
  ShowingGaussians showing;
  showing.not_black = CollectRows<int64_t>(cloud.size(), [&](int64_t i, std::vector<int64_t>& out) {
    if (!IsBlack(cloud, i) && IsUsable(cloud, i)) out.push_back(i);
  });
  using Near = std::pair<double, int64_t>;  // distance², row
  std::vector<Near> all = CollectRows<Near>(cloud.size(), [&](int64_t i, std::vector<Near>& out) {
    const float opacity = Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]);
    const double distance = SquaredDistance(cloud.means.data() + 3 * i, middle.data());
    if (opacity < kShowingOpacity || std::sqrt(distance) > kShowingFarthest * framing.radius) return;
    if (IsUsable(cloud, i)) out.emplace_back(distance, i);
  });
  LeaveIfAbandoned();
  std::vector<Near> bright;
  for (const Near& item : all) {
    if (!IsBlack(cloud, item.second)) bright.push_back(item);
  }
  LeaveIfAbandoned();
  showing.all = Nearest(std::move(all));
  LeaveIfAbandoned();
  showing.bright = bright.size() >= static_cast<size_t>(kLeastGaussians) ? Nearest(std::move(bright)) : showing.all;
  return showing;
}

}  // namespace anchorsplat

#include "reading/visible_gaussians.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/activations.h"
#include "core/random.h"
#include "core/spherical_harmonics.h"
#include "reading/nearest_gaussians.h"

namespace anchorsplat {
namespace {

using Item = NearestGaussians::Item;

TEST(NearestGaussians, AreTheSameInWhateverOrderTheyCome) {
  Random random(1);
  std::vector<Item> items(1000);
  for (size_t i = 0; i < items.size(); ++i) {
    // Each distance several times.
    items[i] = {static_cast<double>(random.Below(300)), static_cast<int64_t>(i), {static_cast<float>(i)}};
  }
  std::vector<Item> sorted = items;
  std::ranges::sort(sorted, {}, [](const Item& item) { return std::pair(item.squared_distance, item.row); });
  for (const size_t most : {size_t{1}, size_t{99}, size_t{999}, size_t{1000}, size_t{5000}}) {
    std::vector<float> expected;
    for (size_t k = 0; k < std::min(most, sorted.size()); ++k) expected.push_back(sorted[k].values[0]);
    std::ranges::sort(expected);
    for (const bool backwards : {false, true}) {
      NearestGaussians nearest(most);
      std::vector<Item> order = items;
      if (backwards) std::ranges::reverse(order);
      for (size_t k = 0; k < order.size(); k += 50) {
        nearest.Add(
            {order.begin() + static_cast<std::ptrdiff_t>(k), order.begin() + static_cast<std::ptrdiff_t>(k) + 50});
      }
      std::optional<double> next;
      const GaussianCloud found = nearest.Take(&next);
      ASSERT_EQ(found.size(), std::ssize(expected));
      for (size_t k = 0; k < expected.size(); ++k) EXPECT_EQ(found.means[3 * k], expected[k]);
      ASSERT_EQ(next.has_value(), most < items.size());
      if (next) {
        EXPECT_EQ(*next, sorted[most].squared_distance);
      }
    }
  }
}

// A ball, a third of it black, with a few rows that are no Gaussians.
GaussianCloud HalfBlackBall(int64_t n) {
  GaussianCloud cloud;
  cloud.Resize(n, 1);
  Random random(8);
  for (float& x : cloud.means) x = static_cast<float>(random.Normal());
  for (float& x : cloud.log_scales) x = static_cast<float>(-4 + 0.5 * random.Normal());
  for (float& x : cloud.quats) x = static_cast<float>(random.Normal());
  for (float& x : cloud.opacity_logits) x = static_cast<float>(3 * random.Normal());
  for (float& x : cloud.sh) x = 0;
  for (int64_t i = 0; i < n; ++i) {
    if (i % 3 == 0) std::fill_n(cloud.sh.data() + i * cloud.sh_stride(), 3, -5.0f);
    if (i % 1000 == 1) cloud.quats[static_cast<size_t>(4 * i)] = std::nanf("");
    if (i % 1000 == 2) cloud.sh[static_cast<size_t>(i * cloud.sh_stride() + 7)] = std::nanf("");
  }
  return cloud;
}

// The rows of the cloud for which `counts` holds and that are no farther from its middle than it says.
template <typename Counts>
std::vector<float> NearestRows(const GaussianCloud& cloud, const Framing& framing, Counts&& counts) {
  std::vector<std::pair<double, int64_t>> near;
  const float middle[] = {static_cast<float>(framing.target[0]), static_cast<float>(framing.target[1]),
                          static_cast<float>(framing.target[2])};
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const double distance = SquaredDistance(cloud.means.data() + 3 * i, middle);
    if (IsUsable(cloud, i) && std::sqrt(distance) <= kMaxVisibleDistance * framing.radius && counts(i)) {
      near.emplace_back(distance, i);
    }
  }
  std::ranges::sort(near);
  near.resize(std::min(near.size(), kMaxVisible));
  std::ranges::sort(near, {}, [](const auto& item) { return item.second; });
  std::vector<float> out;
  for (const auto& item : near) out.push_back(cloud.opacity_logits[static_cast<size_t>(item.second)]);
  return out;
}

TEST(VisibleGaussians, AreThoseThatAPlainSearchFinds) {
  for (const int64_t n : {int64_t{5000}, int64_t{500'000}}) {
    const GaussianCloud cloud = HalfBlackBall(n);
    const Framing framing = FrameCloud(cloud);
    const auto shows = [&](int64_t i) {
      return Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]) >= kVisibleOpacity;
    };
    VisibleGaussians found = FindVisibleGaussians(cloud);
    EXPECT_EQ(std::vector<float>(found.cloud.opacity_logits.begin(), found.cloud.opacity_logits.end()),
              NearestRows(cloud, framing, shows));
    EXPECT_EQ(found.central.framing.target, framing.target);
    EXPECT_EQ(found.central.framing.radius, framing.radius);

    for (const int64_t row : found.rows) EXPECT_TRUE(shows(row));
    EXPECT_EQ(found.central.reach.has_value(), n > 5000);
  }
}

}  // namespace
}  // namespace anchorsplat

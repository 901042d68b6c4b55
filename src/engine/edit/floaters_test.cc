#include "edit/floaters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

struct Scene {
  std::vector<float> places, lengths;
  void Add(double x, double y, double z, double length) {
    for (const double v : {x, y, z}) places.push_back(static_cast<float>(v));
    lengths.push_back(static_cast<float>(length));
  }
  int64_t size() const { return static_cast<int64_t>(lengths.size()); }
};

// Points all over a sphere.
void AddSphere(Random& random, int64_t count, double radius, double length, Scene& scene) {
  for (int64_t i = 0; i < count; ++i) {
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    const double r = radius / std::sqrt(x * x + y * y + z * z);
    scene.Add(r * x, r * y, r * z, length);
  }
}

int64_t Count(const Buffer<uint8_t>& found, int64_t first, int64_t last) {
  int64_t count = 0;
  for (int64_t i = first; i < last; ++i) count += found[static_cast<size_t>(i)];
  return count;
}

TEST(Floaters, NearOnesAndFarOnesAreFound) {
  Random random(1);
  Scene scene;
  AddSphere(random, 20'000, 1, 0.01, scene);
  const int64_t rest = scene.size();
  for (int i = 0; i < 300; ++i) {
    const double along = 0.5 * random.Normal(), across = 0.5 * random.Normal();
    scene.Add(1.5 + 0.3 * random.Uniform(), along, across, 0.01);
  }
  for (int i = 0; i < 300; ++i) scene.Add(8 * random.Normal(), 8 * random.Normal(), 8 * random.Normal(), 0.01);
  const auto found = FindFloaters(scene.places, scene.lengths, {});
  EXPECT_LE(Count(found, 0, rest), rest / 100);
  EXPECT_GE(Count(found, rest, scene.size()), 570);
}

TEST(Floaters, ASkyIsNone) {
  Random random(2);
  Scene scene;
  AddSphere(random, 20'000, 1, 0.01, scene);
  AddSphere(random, 2'000, 50, 2.5, scene);
  // Of which a few are as far from the ground.
  const auto found = FindFloaters(scene.places, scene.lengths, {});
  EXPECT_LE(Count(found, 20'000, scene.size()), 20);
  EXPECT_LE(Count(found, 0, 20'000), 200);
}

TEST(Floaters, UnitsAndOrderDoNotMatter) {
  Random random(3);
  Scene scene;
  AddSphere(random, 3'000, 1, 0.02, scene);
  for (int i = 0; i < 50; ++i) scene.Add(3 * random.Normal(), 3 * random.Normal(), 3 * random.Normal(), 0.02);
  const auto found = FindFloaters(scene.places, scene.lengths, {});
  Scene other;
  for (int64_t i = scene.size() - 1; i >= 0; --i) {
    const auto k = static_cast<size_t>(i);
    other.Add(64.0 * scene.places[3 * k], 64.0 * scene.places[3 * k + 1], 64.0 * scene.places[3 * k + 2],
              64.0 * scene.lengths[k]);
  }
  const auto again = FindFloaters(other.places, other.lengths, {});
  for (size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], again[found.size() - 1 - i]);
  EXPECT_GT(Count(found, 0, scene.size()), 20);
}

TEST(Floaters, FewAndEqualPlacesAreNone) {
  Scene scene;
  EXPECT_TRUE(FindFloaters(scene.places, scene.lengths, {}).empty());
  for (int i = 0; i < 8; ++i) scene.Add(i, 0, 0, 0.01);
  EXPECT_EQ(Count(FindFloaters(scene.places, scene.lengths, {}), 0, 8), 0);
  for (int i = 0; i < 5000; ++i) scene.Add(1, 1, 1, 0.01);
  EXPECT_EQ(Count(FindFloaters(scene.places, scene.lengths, {}), 8, scene.size()), 0);
}

}  // namespace
}  // namespace anchorsplat

#include "compact/compact_features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "compact/sheet_cloud_for_test.h"
#include "core/spherical_harmonics.h"

namespace anchorsplat {
namespace {

const float kPixel = kSheetPixel;

TEST(CompactGraph, FramesAreOrderedAndLookAtTheNeighbours) {
  const GaussianCloud cloud = SheetCloud(200);
  const CompactGraph graph = BuildCompactGraph(cloud, 6);
  ASSERT_EQ(graph.neighbours, 6);
  for (int64_t i = 0; i < 200; ++i) {
    double to_neighbours[3] = {0, 0, 0}, before = 0;
    for (int64_t k = 0; k < 6; ++k) {
      const int64_t j = graph.index[static_cast<size_t>(6 * i + k)];
      double d[3], square = 0;
      for (int64_t c = 0; c < 3; ++c) {
        d[c] = double{cloud.means[static_cast<size_t>(3 * j + c)]} - cloud.means[static_cast<size_t>(3 * i + c)];
        square += d[c] * d[c];
      }
      EXPECT_GE(square, before);
      before = square;
      for (int c = 0; c < 3; ++c) to_neighbours[c] += d[c] / std::sqrt(square);
    }
    float last = 1e9f;
    for (int64_t a = 0; a < 3; ++a) {
      const float s = cloud.log_scales[static_cast<size_t>(3 * i + graph.stored_axis[static_cast<size_t>(3 * i + a)])];
      EXPECT_LE(s, last);
      last = s;
      const float* axis = graph.axis(i, a);
      const double along = axis[0] * to_neighbours[0] + axis[1] * to_neighbours[1] + axis[2] * to_neighbours[2];
      EXPECT_NEAR(along / 6, graph.sidedness[static_cast<size_t>(3 * i + a)], 1e-5);
      EXPECT_GE(graph.sidedness[static_cast<size_t>(3 * i + a)], 0);
    }
  }
}

TEST(CompactGraph, PatchesHoldEachOther) {
  for (const int64_t n : {1, 3, 8, 90, 97}) {
    const CompactGraph graph = BuildCompactGraph(SheetCloud(n), 7, CompactContext::kPatches);
    ASSERT_EQ(graph.neighbours, std::min<int64_t>(7, n - 1));
    const int64_t m = graph.neighbours;
    int64_t mutual = 0;
    for (int64_t i = 0; i < n; ++i) {
      const int32_t* of = graph.index.data() + i * m;
      EXPECT_EQ(std::count(of, of + m, i), 0);
      for (int64_t k = 0; k < m; ++k) {
        EXPECT_EQ(std::count(of, of + m, of[k]), 1);
        const int32_t* back = graph.index.data() + of[k] * m;
        mutual += std::count(back, back + m, i);
      }
    }
    // Only those that a last patch borrows do not hear from it.
    EXPECT_GE(mutual, (n - n % 8) * m);
  }
}

// What features mean, on a pair of Gaussians whose numbers are easily made by hand.
TEST(CompactFeatures, OfTwoGaussians) {
  GaussianCloud cloud;
  cloud.Resize(2, 3);
  const float p = 0.5f;
  std::fill(cloud.means.begin(), cloud.means.end(), 0.0f);
  cloud.means[3] = -3 * p;                                      // the second lies along −x
  const float scales[] = {0.2f, 2.0f, 1.0f, 4.0f, 2.0f, 1.0f};  // of p
  for (size_t i = 0; i < 6; ++i) cloud.log_scales[i] = std::log(p * scales[i]);
  std::fill(cloud.quats.begin(), cloud.quats.end(), 0.0f);
  cloud.quats[0] = 3;
  cloud.quats[4] = 1;
  cloud.opacity_logits = {2, -60};
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.0f);
  cloud.sh[1] = 0.5f;  // green DC
  cloud.sh[48 + 1] = 0.9f;
  cloud.sh[9] = -0.3f;     // the coefficient of −x, red: brighter along +x
  cloud.sh[3 * 4] = 0.4f;  // degree 2
  cloud.sh[3 * 9] = 0.2f;  // degree 3
  const CompactGraph graph = BuildCompactGraph(cloud, 8);
  ASSERT_EQ(graph.neighbours, 1);
  const CompactFeatures features(cloud, graph, {.pixel_sizes = {&p, 1}, .upscale = 4});
  std::vector<float> node(kNodeFeatures), edge(kEdgeFeatures);
  features.Nodes(0, 1, node.data());
  features.Edges(0, 1, edge.data());

  // Longest first: stored axes y, z, x; x points to the neighbour, to −x.
  EXPECT_NEAR(node[0], std::log(2.0) / 2, 1e-6);
  EXPECT_NEAR(node[1], 0, 1e-6);
  EXPECT_NEAR(node[2], std::log(0.2) / 2, 1e-6);
  EXPECT_EQ(node[3], 0.5f);
  EXPECT_EQ(node[5], 0.25f);
  EXPECT_NEAR(node[7 + 3 * 2], -0.6, 1e-6);  // along −x it gets darker
  EXPECT_NEAR(node[16], 5 * 0.4 / std::sqrt(15.0), 1e-6);
  EXPECT_NEAR(node[17], 5 * 0.2 / std::sqrt(21.0), 1e-6);
  EXPECT_EQ(node[18], 1);
  EXPECT_NEAR(node[19], std::log(3.0) / 2, 1e-6);
  EXPECT_EQ(node[19], node[20]);
  EXPECT_EQ(node[21], 0);
  EXPECT_EQ(node[23], 1);

  EXPECT_EQ(edge[0], 0);
  EXPECT_NEAR(edge[2], std::asinh(3.0) / 2, 1e-6);
  EXPECT_NEAR(edge[3], std::log(3.0) / 2, 1e-6);
  EXPECT_NEAR(edge[6], std::asinh(3.0 / std::sqrt(0.04 + 0.2)) / 2, 1e-6);
  // The other's scales along y, z, x are 2, 1, 4.
  EXPECT_NEAR(edge[7], std::log(2.0) / 2, 1e-6);
  EXPECT_NEAR(edge[8], 0, 1e-6);
  EXPECT_NEAR(edge[9], std::log(4.0) / 2, 1e-6);
  for (size_t c : {10u, 11u, 12u, 13u, 14u}) EXPECT_NEAR(edge[c], 0, 1e-6) << c;
  EXPECT_NEAR(edge[16], 0.2, 1e-6);

  features.Nodes(1, 2, node.data());
  EXPECT_EQ(node[3], -2);  // bounded

  // A network that is told the kind of splat sees three more, and nothing else changes.
  cloud.render_mode = RenderMode::kMip;
  const CompactFeatures told(
      cloud, graph, {.pixel_sizes = {&p, 1}, .upscale = 4, .strength = 0.25, .node_features = kMostNodeFeatures});
  std::vector<float> both(2 * kMostNodeFeatures);
  told.Nodes(0, 2, both.data());
  EXPECT_TRUE(std::equal(node.begin(), node.end(), both.begin() + kMostNodeFeatures));
  for (const size_t row : {0u, 1u}) {
    const float* kind = both.data() + row * kMostNodeFeatures + kNodeFeatures;
    EXPECT_EQ(kind[0], 0.25f);
    EXPECT_EQ(kind[1], 0.0f);
    EXPECT_EQ(kind[2], 1.0f);
  }
}

// The vector of degree 1 is where colours rise: ShBasis is the judge.
TEST(CompactFeatures, LinearHarmonicsAreAVector) {
  GaussianCloud cloud = SheetCloud(1);
  const CompactGraph graph = BuildCompactGraph(cloud, 8);
  const CompactFeatures features(cloud, graph, {.pixel_sizes = {&kPixel, 1}, .upscale = 4});
  std::vector<float> node(kNodeFeatures);
  features.Nodes(0, 1, node.data());
  for (int64_t a = 0; a < 3; ++a) {
    const float* axis = graph.axis(0, a);
    const auto basis = ShBasis<double>(axis[0], axis[1], axis[2]);
    for (size_t c = 0; c < 3; ++c) {
      const double colour = basis[1] * cloud.sh[3 + c] + basis[2] * cloud.sh[6 + c] + basis[3] * cloud.sh[9 + c];
      EXPECT_NEAR(node[7 + 3 * static_cast<size_t>(a) + c], 2 * colour / kSh1, 1e-5);
    }
  }
  EXPECT_EQ(node[19], 3);  // no neighbours
}

}  // namespace
}  // namespace anchorsplat

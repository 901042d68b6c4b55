#include "network/torch/render_op.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "core/random.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

using test::RandomCamera;
using test::RandomCloud;

GaussianTensors Leaves(const GaussianCloud& cloud) {
  GaussianTensors g = ToTensors(cloud);
  for (torch::Tensor* tensor : {&g.means, &g.log_scales, &g.quats, &g.opacity_logits, &g.sh}) {
    tensor->requires_grad_(true);
  }
  return g;
}

std::vector<torch::Tensor> All(const GaussianTensors& g) {
  return {g.means, g.log_scales, g.quats, g.opacity_logits, g.sh};
}

// Weights that are plain numbers of the seed: Σ weight·value is a loss with a known gradient.
torch::Tensor Weights(const torch::Tensor& like, uint64_t seed) {
  torch::Tensor weights = torch::empty(like.sizes());
  Random random(seed);
  for (int64_t i = 0; i < like.numel(); ++i) {
    weights.mutable_data_ptr<float>()[i] = static_cast<float>(random.Normal());
  }
  return weights;
}

TEST(RenderOp, GradientIsTheRasterizersSummedOverTheViews) {
  const GaussianCloud cloud = RandomCloud(3, {.gaussians = 300, .degree = 2});
  const std::vector<Camera> cameras = {RandomCamera(1, 67, 41), RandomCamera(2, 40, 50), RandomCamera(5, 31, 33)};
  const RenderOptions options{.background = {0.2f, 0.5f, 0.1f}};
  const GaussianTensors g = Leaves(cloud);
  RenderOp op;
  const auto views = op(g, cameras, options);
  ASSERT_TRUE(views.ok()) << views.error().message;
  torch::Tensor loss = torch::zeros({});
  for (size_t v = 0; v < cameras.size(); ++v) {
    loss = loss + ((*views)[v].color * Weights((*views)[v].color, v)).sum() +
           ((*views)[v].alpha * Weights((*views)[v].alpha, v + 10)).sum();
  }
  loss.backward();

  CloudGradient sum;
  for (size_t v = 0; v < cameras.size(); ++v) {
    Rasterizer rasterizer;
    RenderOutput output;
    RenderOptions own = options;
    own.gradient = true;
    ASSERT_TRUE(rasterizer.Render(cloud, cameras[v], own, output).ok());
    EXPECT_TRUE((*views)[v].color.equal(torch::from_blob(output.color.pixels.data(), (*views)[v].color.sizes())));
    RenderGradient weights;
    weights.color = output.color;
    weights.alpha = output.alpha;
    const torch::Tensor color = Weights((*views)[v].color, v), alpha = Weights((*views)[v].alpha, v + 10);
    std::copy_n(color.const_data_ptr<float>(), color.numel(), weights.color.pixels.data());
    std::copy_n(alpha.const_data_ptr<float>(), alpha.numel(), weights.alpha.pixels.data());
    weights.box = {0, 0, output.color.width, output.color.height};
    CloudGradient gradient;
    ASSERT_TRUE(rasterizer.Backward(cloud, weights, gradient).ok());
    if (v == 0) {
      sum = gradient;
      continue;
    }
    for (const auto member : {&CloudGradient::means, &CloudGradient::log_scales, &CloudGradient::quats,
                              &CloudGradient::opacity_logits, &CloudGradient::sh}) {
      for (size_t i = 0; i < (sum.*member).size(); ++i) (sum.*member)[i] += (gradient.*member)[i];
    }
  }
  EXPECT_TRUE(g.means.grad().equal(torch::from_blob(sum.means.data(), g.means.sizes())));
  EXPECT_TRUE(g.log_scales.grad().equal(torch::from_blob(sum.log_scales.data(), g.log_scales.sizes())));
  EXPECT_TRUE(g.quats.grad().equal(torch::from_blob(sum.quats.data(), g.quats.sizes())));
  EXPECT_TRUE(g.opacity_logits.grad().equal(torch::from_blob(sum.opacity_logits.data(), g.opacity_logits.sizes())));
  EXPECT_TRUE(g.sh.grad().equal(torch::from_blob(sum.sh.data(), g.sh.sizes())));
  EXPECT_GT(g.sh.grad().abs().max().item<float>(), 0);
}

// Through whatever network: the chain rule, against a difference quotient along a random direction. Without cut-offs
// the picture is smooth in everything but the order of depths.
TEST(RenderOp, MatchesADifferenceQuotientThroughAnotherOperation) {
  GaussianCloud cloud = RandomCloud(8, {.gaussians = 60, .degree = 1, .smallest = 0.1, .largest = 0.3});
  for (size_t i = 0; i < cloud.means.size(); ++i) cloud.means[i] = std::fmod(cloud.means[i], 0.9f);
  for (float& c : cloud.sh) c *= 0.3f;
  const std::vector<Camera> cameras = {RandomCamera(4, 32, 24)};
  const RenderOptions options{.min_alpha = 1e-12f, .min_transmittance = 0};
  RenderOp op;
  torch::manual_seed(5);
  const torch::Tensor direction = torch::randn({cloud.size()});
  torch::Tensor knob = torch::zeros({}, torch::requires_grad());
  const auto loss = [&] {
    GaussianTensors g = ToTensors(cloud);
    g.opacity_logits = g.opacity_logits + knob * direction;
    g.log_scales = g.log_scales + 0.1 * knob * direction.unsqueeze(1);
    auto views = op(g, cameras, options);
    EXPECT_TRUE(views.ok());
    return ((*views)[0].color * Weights((*views)[0].color, 6)).sum();
  };
  loss().backward();
  const double slope = knob.grad().item<double>();
  const torch::NoGradGuard no_gradient;
  const auto at = [&](double value) {
    knob.fill_(value);
    return loss().item<double>();
  };
  const double quotient = (at(5e-3) - at(-5e-3)) / 1e-2;
  EXPECT_NEAR(slope, quotient, 1e-2 * std::abs(quotient) + 1e-3);
  EXPECT_GT(std::abs(quotient), 0.01);
}

TEST(RenderOp, BitsDoNotDependOnThreadsOrOnViewsSideBySide) {
  const GaussianCloud cloud = RandomCloud(13, {.gaussians = 400});
  const std::vector<Camera> cameras = {RandomCamera(1, 64, 64), RandomCamera(2, 64, 64), RandomCamera(3, 64, 64)};
  const auto gradients = [&](int threads) {
    SetThreadCount(threads);
    RenderOp op;
    const GaussianTensors g = Leaves(cloud);
    auto views = op(g, cameras, {});
    EXPECT_TRUE(views.ok());
    torch::Tensor loss = torch::zeros({});
    for (const RenderedView& view : *views) loss = loss + view.color.square().sum();
    loss.backward();
    SetThreadCount(0);
    std::vector<torch::Tensor> result;
    for (const torch::Tensor& leaf : All(g)) result.push_back(leaf.grad());
    return result;
  };
  const auto one = gradients(1), three = gradients(3);
  for (size_t i = 0; i < one.size(); ++i) EXPECT_TRUE(one[i].equal(three[i])) << i;
}

TEST(RenderOp, ACropIsAPartOfThePicture) {
  GaussianCloud cloud = RandomCloud(21, {.gaussians = 200, .largest = 0.1});
  const Camera camera = RandomCamera(9, 96, 80);
  RenderOp op;
  const torch::NoGradGuard no_gradient;
  const auto full = op(ToTensors(cloud), std::vector<Camera>{camera}, {});
  const auto part = op(ToTensors(cloud), std::vector<Camera>{Crop(camera, {32, 16, 80, 64})}, {});
  ASSERT_TRUE(full.ok() && part.ok());
  const torch::Tensor expected = (*full)[0].color.slice(1, 16, 64).slice(2, 32, 80);
  // The Jacobian of Gaussians far outside of a picture is clamped by its borders, so a few differ.
  EXPECT_LT(((*part)[0].color - expected).abs().mean().item<double>(), 2e-3);
  EXPECT_GT(expected.std().item<double>(), 0.02);
}

TEST(RenderOp, UnusedOutputsAndGraphsKeptForLater) {
  const GaussianTensors g = Leaves(RandomCloud(2, {.gaussians = 50, .degree = 0}));
  RenderOp op;
  const std::vector<Camera> cameras = {RandomCamera(1, 32, 32), RandomCamera(2, 32, 32)};
  const auto first = op(g, cameras, {});
  const auto second = op(g, std::vector<Camera>{RandomCamera(3, 16, 16)}, {});  // must not take the first's buffers
  ASSERT_TRUE(first.ok() && second.ok());
  (*first)[1].alpha.sum().backward();  // neither colours nor the other view
  const torch::Tensor alone = g.opacity_logits.grad().clone();
  EXPECT_GT(alone.abs().max().item<float>(), 0);
  EXPECT_EQ(g.sh.grad().abs().max().item<float>(), 0);
  g.opacity_logits.mutable_grad().zero_();
  const auto again = op(g, std::vector<Camera>{cameras[1]}, {});
  ASSERT_TRUE(again.ok());
  (*again)[0].alpha.sum().backward();
  EXPECT_TRUE(g.opacity_logits.grad().equal(alone));
}

TEST(RenderOp, EmptySplatsAndBadValues) {
  RenderOp op;
  GaussianCloud cloud = RandomCloud(2, {.gaussians = 20, .degree = 0});
  cloud.means[3] = std::numeric_limits<float>::quiet_NaN();
  cloud.log_scales[9] = std::numeric_limits<float>::infinity();
  for (size_t k = 0; k < 4; ++k) cloud.quats[16 + k] = 0;
  const GaussianTensors g = Leaves(cloud);
  const auto views = op(g, std::vector<Camera>{RandomCamera(1, 32, 32)}, {});
  ASSERT_TRUE(views.ok());
  (*views)[0].color.sum().backward();
  EXPECT_TRUE(g.means.grad().isfinite().all().item<bool>());
  EXPECT_EQ(g.means.grad()[1].abs().max().item<float>(), 0);

  GaussianCloud none;
  none.Resize(0, 0);
  const auto empty = op(Leaves(none), std::vector<Camera>{RandomCamera(1, 8, 8)}, {.background = {1, 0, 0}});
  ASSERT_TRUE(empty.ok());
  EXPECT_EQ((*empty)[0].color[0].min().item<float>(), 1);
  Camera bad = RandomCamera(1, 8, 8);
  bad.intrinsics.fx = 0;
  EXPECT_FALSE(op(g, std::vector<Camera>{bad}, {}).ok());
}

}  // namespace
}  // namespace anchorsplat

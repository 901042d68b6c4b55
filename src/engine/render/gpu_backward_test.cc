// The gradient on the GPU against the CPU's, whose own tests hold it against difference quotients.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/messages_for_test.h"
#include "core/run_context.h"
#include "gpu/faulty_device_for_test.h"
#include "gpu/gpu_for_test.h"
#include "render/gradient_check_for_test.h"
#include "render/scenes_for_test.h"
#include "render/spherical_harmonics_backward.h"

namespace anchorsplat {
namespace {

using test::ExpectGradientMatches;
using test::FrontCamera;
using test::Gradient;
using test::LinearLoss;
using test::OneGaussian;
using test::RandomCamera;
using test::RandomCloud;
using test::RandomLoss;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr DeviceChoice kGpuChoice{DeviceChoice::Kind::kGpu};

// Relative L2 that columns may differ by. Where a pixel lies right on a cut-off, the devices may decide differently;
// RandomLoss has no weights there.
struct Tolerance {
  double shape = 1e-5, other = 1e-5;
};

double RelativeL2(const Buffer<float>& a, const Buffer<float>& b) {
  double difference = 0, size = 0;
  for (size_t i = 0; i < b.size(); ++i) {
    difference += std::pow(double{a[i]} - double{b[i]}, 2);
    size += std::pow(double{b[i]}, 2);
  }
  return difference == 0 ? 0 : std::sqrt(difference / size);
}

bool SameBits(const CloudGradient& a, const CloudGradient& b) {
  const auto same = [](const Buffer<float>& x, const Buffer<float>& y) {
    return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), 4 * x.size()) == 0);
  };
  return same(a.means, b.means) && same(a.log_scales, b.log_scales) && same(a.quats, b.quats) &&
         same(a.opacity_logits, b.opacity_logits) && same(a.sh, b.sh) && same(a.means2d, b.means2d) &&
         same(a.means2d_abs, b.means2d_abs) && a.radii == b.radii && a.background == b.background;
}

class GpuBackward : public testing::Test {
 protected:
  void SetUp() override {
    gpu_ = GpuForTest();
    if (gpu_ == nullptr) GTEST_FAIL() << "no device";
  }

  // By the GPU alone.
  CloudGradient OnGpu(const GaussianCloud& cloud, const Camera& camera, RenderOptions options,
                      const RenderGradient& weights, const GpuFaults& limits = {}) {
    options.gradient = true;
    const RunScope run({.device = kGpuChoice});
    const auto device = std::make_shared<FaultyDevice>(gpu_, limits);
    const ScopedGpuForTest scope(device);
    Rasterizer rasterizer;
    RenderOutput output;
    CloudGradient gradient;
    const Status rendered = rasterizer.Render(cloud, camera, options, output);
    EXPECT_TRUE(rendered.ok()) << rendered.error().message;
    const int calls = device->calls();
    EXPECT_GT(calls, 0) << "drawn by the CPU";
    const Status status = rasterizer.Backward(cloud, weights, gradient);
    EXPECT_TRUE(status.ok()) << status.error().message;
    EXPECT_GT(device->calls(), calls) << "by the CPU";
    EXPECT_EQ(WhyGpuWasGivenUp(), "");
    return gradient;
  }

  CloudGradient Compare(const GaussianCloud& cloud, const Camera& camera, const RenderOptions& options,
                        const RenderGradient& weights, const Tolerance& tolerance = {}) {
    const CloudGradient cpu = Gradient(cloud, camera, options, weights);
    const CloudGradient gpu = OnGpu(cloud, camera, options, weights);
    const auto compare = [](const char* name, const Buffer<float>& a, const Buffer<float>& b, double most) {
      ASSERT_EQ(a.size(), b.size()) << name;
      EXPECT_LE(RelativeL2(a, b), most) << name;
    };
    compare("means", gpu.means, cpu.means, tolerance.shape);
    compare("log_scales", gpu.log_scales, cpu.log_scales, tolerance.shape);
    compare("quats", gpu.quats, cpu.quats, tolerance.shape);
    compare("opacity_logits", gpu.opacity_logits, cpu.opacity_logits, tolerance.other);
    compare("sh", gpu.sh, cpu.sh, tolerance.other);
    compare("means2d", gpu.means2d, cpu.means2d, tolerance.other);
    compare("means2d_abs", gpu.means2d_abs, cpu.means2d_abs, tolerance.other);
    int64_t other_radii = 0;
    EXPECT_EQ(gpu.radii.size(), cpu.radii.size());
    for (size_t i = 0; i < std::min(gpu.radii.size(), cpu.radii.size()); ++i)
      other_radii += gpu.radii[i] != cpu.radii[i];
    EXPECT_LE(other_radii, 2) << "radii are rounded up";
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(gpu.background[c], cpu.background[c], 1e-5 * std::abs(cpu.background[c]) + 1e-5) << c;
    }
    return gpu;
  }

  std::shared_ptr<GpuDevice> gpu_;
};

TEST_F(GpuBackward, EqualsTheCpuInAllModesAndProfiles) {
  const std::array<std::array<int, 2>, 3> sizes = {{{64, 64}, {37, 50}, {16, 17}}};
  for (uint64_t seed = 0; seed < 12; ++seed) {
    RenderOptions options;
    options.profile = seed % 2 == 0 ? RasterProfile::kGsplat14 : RasterProfile::kGsplat15;
    options.mode = kRenderModes[seed / 2 % 3];
    options.compensated_from = seed % 4 == 3 ? 0.05f : 0.0f;
    options.background = {0.3f, static_cast<float>(seed % 3) * 0.5f, 1.0f};
    options.absgrad = seed % 3 == 0;
    const GaussianCloud cloud = RandomCloud(seed, {.gaussians = 400, .degree = static_cast<int>(seed % 4)});
    const Camera camera = RandomCamera(seed, sizes[seed % 3][0], sizes[seed % 3][1]);
    SCOPED_TRACE(seed);
    // As differences of products, the CPU's compensation of a flat Gaussian loses digits that the kernel has.
    const Tolerance tolerance = {.shape = IsCompensated(options.mode) ? 2e-4 : 1e-5};
    Compare(cloud, camera, options, RandomLoss(seed, cloud, camera, options, seed % 2 == 0).weights, tolerance);
  }
}

TEST_F(GpuBackward, EqualsTheCpuOnDeepTilesAndWithoutCutOffs) {
  RenderOptions options;
  options.min_alpha = 1e-9f;
  options.min_transmittance = 0;
  options.sh_degree = 1;  // of 2
  const GaussianCloud cloud = RandomCloud(30, {.gaussians = 900, .degree = 2, .smallest = 0.05, .largest = 0.5});
  const Camera camera = RandomCamera(30, 33, 17);
  const CloudGradient gradient = Compare(cloud, camera, options, RandomLoss(30, cloud, camera, options).weights);
  for (size_t i = 0; i < 900; ++i) {
    for (size_t k = 12; k < 27; ++k) ASSERT_EQ(gradient.sh[27 * i + k], 0.0f);
  }
}

// The sums of one pixel have few digits about the middle of a tile, where the CPU's are.
TEST_F(GpuBackward, MatchesDifferenceQuotientsOnOnePixel) {
  const RunScope run({.device = kGpuChoice});
  const ScopedGpuForTest scope(gpu_);
  RenderOptions options;
  options.min_alpha = 1e-9f;
  options.min_transmittance = 0;
  const GaussianCloud cloud = RandomCloud(7, {.gaussians = 12, .degree = 1});
  const Camera camera = RandomCamera(7, 1, 1);
  ExpectGradientMatches(cloud, camera, options, RandomLoss(7, cloud, camera, options));
  EXPECT_EQ(WhyGpuWasGivenUp(), "");
}

TEST_F(GpuBackward, NeedlesKeepTheirDigits) {
  const RunScope run({.device = kGpuChoice});
  const ScopedGpuForTest scope(gpu_);
  RenderOptions options;
  options.min_alpha = 1e-9f;
  options.min_transmittance = 0;
  GaussianCloud cloud = RandomCloud(50, {.gaussians = 8, .degree = 0});
  for (size_t i = 0; i < 8; ++i) {
    cloud.log_scales[3 * i] = 0.5f;  // longer than the picture is wide
    cloud.log_scales[3 * i + 1] = -7.0f;
    cloud.log_scales[3 * i + 2] = i % 2 == 0 ? -kInfinity : -8.0f;
    for (size_t a = 0; a < 3; ++a) cloud.means[3 * i + a] *= 0.3f;
  }
  const Camera camera = RandomCamera(50, 48, 33);
  for (const RenderMode mode : {RenderMode::kClassic, RenderMode::kAntialiased}) {
    options.mode = mode;
    const LinearLoss loss = RandomLoss(50, cloud, camera, options);
    ExpectGradientMatches(cloud, camera, options, loss, {.relative = 5e-3, .absolute = 5e-4});
  }
  EXPECT_EQ(WhyGpuWasGivenUp(), "");
}

TEST_F(GpuBackward, EqualsTheCpuWhereSomethingIsCapped) {
  // Nearly opaque everywhere, with something behind it; a colour that is clamped; means far outside of the picture,
  // where the Jacobian is clamped.
  GaussianCloud cloud = OneGaussian(0, 0, 3, 50, 0.5, {0.5f, -0.4f, 0.3f});
  cloud.opacity_logits[0] = 12;
  ASSERT_TRUE(Append(cloud, OneGaussian(0.1, 0, 4, 0.4, 0.6)).ok());
  for (const auto& [x, y] : {std::pair{2.5, 0.2}, {-2.4, 0.1}, {0.1, 2.5}, {-2.5, -2.6}}) {
    ASSERT_TRUE(Append(cloud, OneGaussian(x, y, 2.1 + 0.01 * x, 1.1, 0.6)).ok());
  }
  for (size_t i = 0; i < cloud.quats.size(); ++i) cloud.quats[i] += 0.1f * static_cast<float>(i % 5);
  for (size_t i = 0; i < 6; ++i) cloud.log_scales[3 * i + 1] -= 0.5f;
  const Camera camera = FrontCamera(16, 16, 16);
  const CloudGradient gradient = Compare(cloud, camera, {}, RandomLoss(1, cloud, camera, {}).weights);
  EXPECT_EQ(gradient.sh[1], 0.0f);
}

TEST_F(GpuBackward, EqualsTheCpuOfWhatIsNotSeen) {
  GaussianCloud cloud = OneGaussian(0, 0, 3, 0.2, 0.8);
  for (const double z : {-3.0, 3.0, 2.0, 3.5, 3.6, 2.5, 3.0}) {
    ASSERT_TRUE(Append(cloud, OneGaussian(z == 3.0 ? 50 : 0.1, 0.1, z, 0.2, 0.7)).ok());
  }
  cloud.means[9] = std::nanf("");
  std::fill_n(&cloud.quats[16], 4, 0.0f);             // the zero quaternion
  std::fill_n(&cloud.log_scales[15], 3, -kInfinity);  // scale 0
  cloud.opacity_logits[6] = -kInfinity;               // invisible
  cloud.log_scales[21] = kInfinity;                   // of infinite scale
  const Camera camera = FrontCamera(33, 20, 30);
  const CloudGradient gradient = Compare(cloud, camera, {}, RandomLoss(1, cloud, camera, {}).weights);
  for (const size_t i : {1, 2, 3, 6, 7}) EXPECT_EQ(gradient.opacity_logits[i], 0.0f) << i;
  for (const size_t i : {0, 4, 5}) EXPECT_NE(gradient.opacity_logits[i], 0.0f) << i;
  for (size_t a = 0; a < 4; ++a) EXPECT_EQ(gradient.quats[16 + a], 0.0f);
}

TEST_F(GpuBackward, EqualsTheCpuOfNoneAndOfOne) {
  const Camera camera = RandomCamera(3, 40, 30);
  for (const int64_t n : {0, 1}) {
    const GaussianCloud cloud = RandomCloud(3, {.gaussians = n});
    const RenderGradient weights = RandomLoss(3, cloud, camera, {}).weights;
    const CloudGradient gradient = Compare(cloud, camera, {}, weights, {.shape = 1e-4});
    EXPECT_EQ(gradient.means.size(), static_cast<size_t>(3 * n));
  }
  // None of many is seen.
  GaussianCloud hidden = RandomCloud(3, {.gaussians = 20});
  for (size_t i = 0; i < 20; ++i) hidden.means[3 * i] += 1000;
  const CloudGradient gradient = Compare(hidden, camera, {}, RandomLoss(3, hidden, camera, {}).weights);
  for (const float g : gradient.sh) EXPECT_EQ(g, 0.0f);
}

// Beyond what floats hold, the rows are the CPU's.
TEST_F(GpuBackward, EqualsTheCpuOfUnusualShapes) {
  GaussianCloud cloud = RandomCloud(5, {.gaussians = 60, .degree = 1});
  for (size_t i = 0; i < 60; i += 7) {
    const float factor = i % 2 == 0 ? 1e-20f : 1e18f;
    for (size_t a = 0; a < 4; ++a) cloud.quats[4 * i + a] *= factor;
  }
  const Camera camera = RandomCamera(5, 40, 30);
  Compare(cloud, camera, {}, RandomLoss(5, cloud, camera, {}).weights);
}

TEST_F(GpuBackward, OutsideOfTheBoxNothingIsRead) {
  const GaussianCloud cloud = RandomCloud(71, {.gaussians = 300, .degree = 1});
  const Camera camera = RandomCamera(71, 70, 45);
  RenderGradient weights = RandomLoss(71, cloud, camera, {}).weights;
  weights.box = {5, 17, 38, 31};
  for (int y = 0; y < 45; ++y) {
    for (int x = 0; x < 70; ++x) {
      if (x >= 5 && x < 38 && y >= 17 && y < 31) continue;
      for (int c = 0; c < 3; ++c) weights.color.at(c, y, x) = std::nanf("");
      weights.alpha.at(0, y, x) = std::nanf("");
    }
  }
  Compare(cloud, camera, {}, weights);
  weights.box = {};
  Compare(cloud, camera, {}, weights);
}

TEST_F(GpuBackward, WhatIsNotFiniteSpoilsOnlyWhatItsPixelAdds) {
  const GaussianCloud cloud = RandomCloud(72, {.gaussians = 400, .degree = 0, .largest = 0.1});
  const Camera camera = RandomCamera(72, 64, 64);
  RenderGradient weights = RandomLoss(72, cloud, camera, {}).weights;
  weights.color.at(1, 30, 31) = std::nanf("");
  int64_t spoilt = 0;
  for (const float g : OnGpu(cloud, camera, {}, weights).opacity_logits) spoilt += !std::isfinite(g);
  EXPECT_GT(spoilt, 0);
  EXPECT_LT(spoilt, 100);
}

TEST_F(GpuBackward, NeitherRunsOfTilesNorBlocksOfRowsChangeABit) {
  const GaussianCloud cloud = RandomCloud(70, {.gaussians = 1000, .degree = 3, .smallest = 0.01, .largest = 0.3});
  const Camera camera = RandomCamera(70, 64, 64);
  RenderOptions options;
  options.absgrad = true;
  const RenderGradient weights = RandomLoss(70, cloud, camera, options).weights;
  const CloudGradient one = OnGpu(cloud, camera, options, weights);
  EXPECT_TRUE(SameBits(OnGpu(cloud, camera, options, weights), one));
  // Slots for some tiles at a time, and the gradient of some rows.
  EXPECT_TRUE(SameBits(OnGpu(cloud, camera, options, weights, {.max_binding = 96 << 10}), one));
  options.max_pairs = 700;
  EXPECT_TRUE(SameBits(OnGpu(cloud, camera, options, weights), one));
  // The gradient of the picture in pieces, too.
  const Camera wide = RandomCamera(70, 400, 20);
  const RenderGradient wide_weights = RandomLoss(70, cloud, wide, options).weights;
  EXPECT_TRUE(SameBits(OnGpu(cloud, wide, options, wide_weights, {.max_binding = 260 << 10}),
                       OnGpu(cloud, wide, options, wide_weights)));
}

TEST_F(GpuBackward, LessMemoryMeansMoreRunsOfTiles) {
  const GaussianCloud cloud = RandomCloud(70, {.gaussians = 1000, .degree = 1, .smallest = 0.01, .largest = 0.3});
  const Camera camera = RandomCamera(70, 64, 64);
  const RenderGradient weights = RandomLoss(70, cloud, camera, {}).weights;
  RenderOptions options;
  options.gradient = true;
  const CloudGradient expected = OnGpu(cloud, camera, options, weights);
  const Messages messages;
  std::set<int> calls;  // of those that did not give up
  bool gave_up = false;
  for (uint64_t memory = 400 << 10; memory < (2 << 20); memory += 50 << 10) {
    const RunScope run({.device = kGpuChoice, .max_gpu_memory = memory});
    const auto device = std::make_shared<FaultyDevice>(gpu_, GpuFaults{});
    const ScopedGpuForTest scope(device);
    Rasterizer rasterizer;
    RenderOutput output;
    CloudGradient gradient;
    ASSERT_TRUE(rasterizer.Render(cloud, camera, options, output).ok());
    const int before = device->calls();
    ASSERT_TRUE(rasterizer.Backward(cloud, weights, gradient).ok());
    if (WhyGpuWasGivenUp().empty()) {
      calls.insert(device->calls() - before);
      EXPECT_TRUE(SameBits(gradient, expected)) << memory;
    } else {
      gave_up = true;
      EXPECT_LE(RelativeL2(gradient.means, expected.means), 1e-5) << memory;
    }
  }
  EXPECT_TRUE(gave_up);
  EXPECT_GT(calls.size(), 1u);
}

// Coefficients with their moments, as an optimiser has them.
struct Stepped {
  GaussianCloud cloud;
  Buffer<float> first_moment, second_moment;
  explicit Stepped(const GaussianCloud& from)
      : cloud(from), first_moment(from.sh.size(), 0.01f), second_moment(from.sh.size(), 0.02f) {}
  CoefficientStep Step() {
    return {MakeAdamNumbers(0.9, 0.999, 1e-15f, 3),
            cloud.sh_stride(),
            0.002f,
            0.0001f,
            first_moment.data(),
            second_moment.data(),
            cloud.sh.data()};
  }
  bool operator==(const Stepped& other) const {
    return cloud.sh == other.cloud.sh && first_moment == other.first_moment && second_moment == other.second_moment;
  }
};

// Renders and goes back once on a device that fails as it is told, if that is at all.
struct Attempt {
  Stepped stepped;
  CloudGradient gradient;
  std::string given_up;
  int render_calls = 0, calls = 0, render_allocations = 0, allocations = 0;
};
Attempt TryOn(const std::shared_ptr<GpuDevice>& gpu, const GaussianCloud& cloud, const Camera& camera,
              const RenderGradient& weights, const GpuFaults& faults) {
  const Messages messages;
  const RunScope run({.device = kGpuChoice});
  const auto device = std::make_shared<FaultyDevice>(gpu, faults);
  const ScopedGpuForTest scope(device);
  RenderOptions options;
  options.gradient = true;
  Attempt attempt{Stepped(cloud), {}, {}};
  Rasterizer rasterizer;
  RenderOutput output;
  EXPECT_TRUE(rasterizer.Render(attempt.stepped.cloud, camera, options, output).ok());
  attempt.render_calls = device->calls(), attempt.render_allocations = device->allocations();
  const CoefficientStep step = attempt.stepped.Step();
  const Status status = rasterizer.Backward(attempt.stepped.cloud, weights, attempt.gradient, &step);
  EXPECT_TRUE(status.ok()) << status.error().message;
  attempt.calls = device->calls(), attempt.allocations = device->allocations();
  attempt.given_up = WhyGpuWasGivenUp();
  return attempt;
}

class GpuBackwardFaults : public GpuBackward {
 protected:
  const GaussianCloud cloud_ = RandomCloud(80, {.gaussians = 300, .degree = 2});
  const Camera camera_ = RandomCamera(80, 40, 30);
  const RenderGradient weights_ = RandomLoss(80, cloud_, camera_, {}).weights;
};

TEST_F(GpuBackwardFaults, AStepIsThatOfAGradientThatIsWrittenDown) {
  const Attempt attempt = TryOn(gpu_, cloud_, camera_, weights_, {});
  EXPECT_EQ(attempt.given_up, "");
  EXPECT_TRUE(attempt.gradient.sh.empty());
  const CloudGradient written = OnGpu(cloud_, camera_, {}, weights_);
  Stepped expected(cloud_);
  StepCoefficients(expected.Step(), cloud_.sh_stride(), cloud_.size(), written.sh.data());
  EXPECT_TRUE(attempt.stepped == expected);
  EXPECT_EQ(attempt.gradient.means, written.means);
}

TEST_F(GpuBackwardFaults, WhereTheDeviceIsLostTheCpuGoesOn) {
  const Attempt whole = TryOn(gpu_, cloud_, camera_, weights_, {});
  RenderOptions options;
  options.gradient = true;
  Stepped expected(cloud_);
  CloudGradient gradient;
  Rasterizer rasterizer;
  RenderOutput output;
  ASSERT_TRUE(rasterizer.Render(expected.cloud, camera_, options, output).ok());
  const CoefficientStep step = expected.Step();
  ASSERT_TRUE(rasterizer.Backward(expected.cloud, weights_, gradient, &step).ok());
  ASSERT_GT(whole.calls, whole.render_calls);
  for (int calls = whole.render_calls; calls < whole.calls; ++calls) {
    const Attempt lost = TryOn(gpu_, cloud_, camera_, weights_, {.calls = calls});
    EXPECT_NE(lost.given_up.find("lost"), std::string::npos) << calls << ": " << lost.given_up;
    EXPECT_TRUE(SameBits(lost.gradient, gradient)) << calls;
    EXPECT_TRUE(lost.stepped == expected) << calls;
  }
}

TEST_F(GpuBackwardFaults, WhereThereIsNoMemoryTheCpuGoesOn) {
  const Attempt whole = TryOn(gpu_, cloud_, camera_, weights_, {});
  ASSERT_GT(whole.allocations, whole.render_allocations);
  for (int allowed = whole.render_allocations; allowed < whole.allocations; ++allowed) {
    const Attempt attempt = TryOn(gpu_, cloud_, camera_, weights_, {.allocations = allowed});
    EXPECT_NE(attempt.given_up, "") << allowed;
    ASSERT_EQ(attempt.gradient.means.size(), whole.gradient.means.size());
    EXPECT_LE(RelativeL2(attempt.gradient.means, whole.gradient.means), 1e-5) << allowed;
    EXPECT_LE(RelativeL2(attempt.stepped.cloud.sh, whole.stepped.cloud.sh), 1e-5) << allowed;
  }
}

TEST_F(GpuBackwardFaults, WhatIsSeenEqualsTheCpu) {
  RenderOptions options;
  options.gradient = true;
  Rasterizer on_cpu, on_gpu;
  RenderOutput output;
  ASSERT_TRUE(on_cpu.Render(cloud_, camera_, options, output).ok());
  const Result<AppearanceGradient> expected = on_cpu.BackwardToAppearance(cloud_, weights_);
  ASSERT_TRUE(expected.ok());
  int64_t taught = 0;
  const auto compare = [&](const GpuFaults& faults) {
    const RunScope run({.device = kGpuChoice});
    const auto device = std::make_shared<FaultyDevice>(gpu_, faults);
    const ScopedGpuForTest scope(device);
    ASSERT_TRUE(on_gpu.Render(cloud_, camera_, options, output).ok());
    const int calls = device->calls();
    const Result<AppearanceGradient> seen = on_gpu.BackwardToAppearance(cloud_, weights_);
    ASSERT_TRUE(seen.ok()) << seen.error().message;
    EXPECT_GT(device->calls(), calls);
    EXPECT_EQ(WhyGpuWasGivenUp().empty(), faults.calls < 0);
    for (int64_t i = 0; i < cloud_.size(); ++i) {
      const auto near = [&](float a, float b) { EXPECT_NEAR(a, b, 1e-4 * std::abs(b) + 1e-6) << i; };
      near(seen->OfLogOpacity(i), expected->OfLogOpacity(i));
      for (size_t c = 0; c < 3; ++c) near(seen->OfColor(i, c), expected->OfColor(i, c));
      taught += seen->OfLogOpacity(i) != 0;
    }
    EXPECT_TRUE(std::equal(seen->radii.begin(), seen->radii.end(), expected->radii.begin(), expected->radii.end()));
  };
  compare({});
  EXPECT_GT(taught, 100);
  compare({.calls = TryOn(gpu_, cloud_, camera_, weights_, {}).render_calls + 5});
}

TEST_F(GpuBackwardFaults, RefusesWhatTheCpuRefuses) {
  const RunScope run({.device = kGpuChoice});
  const auto device = std::make_shared<FaultyDevice>(gpu_, GpuFaults{});
  const ScopedGpuForTest scope(device);
  RenderOptions options;
  options.gradient = true;
  Rasterizer rasterizer;
  RenderOutput output;
  CloudGradient gradient;
  ASSERT_TRUE(rasterizer.Render(cloud_, camera_, options, output).ok());
  const int calls = device->calls();
  RenderGradient weights = weights_;
  weights.box.x1 = 41;
  const Status outside = rasterizer.Backward(cloud_, weights, gradient);
  ASSERT_FALSE(outside.ok());
  EXPECT_NE(outside.error().message.find("41"), std::string::npos);
  const Status other = rasterizer.Backward(RandomCloud(1, {.gaussians = 7}), weights_, gradient);
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("not of 7"), std::string::npos);
  EXPECT_EQ(device->calls(), calls);
  EXPECT_EQ(WhyGpuWasGivenUp(), "");
}

}  // namespace
}  // namespace anchorsplat

#include "perceptual/torch/lpips_network.h"

#include <ATen/Parallel.h>
#include <c10/core/GradMode.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "perceptual/lpips.h"
#include "perceptual/lpips_synthetic_for_test.h"

namespace anchorsplat {
namespace {

// Small pictures: waking threads would cost more than the work.
const bool kOneThread = [] {
  at::set_num_threads(1);
  return true;
}();

const std::vector<LpipsNet> kNets = {LpipsNet::kAlex, LpipsNet::kVgg, LpipsNet::kSqueeze};

// ---- The plain reference: loops in double precision, the architectures written down a second time.

struct Planes {
  int c, h, w;
  std::vector<double> v;
  double at(int k, int y, int x) const { return v[static_cast<size_t>((k * h + y) * w + x)]; }
};

Planes ConvolveRelu(const Planes& in, const Buffer<float>& weight, const Buffer<float>& bias, int kernel, int stride,
                    int padding) {
  const int out = static_cast<int>(bias.size());
  Planes r{out, (in.h + 2 * padding - kernel) / stride + 1, (in.w + 2 * padding - kernel) / stride + 1, {}};
  for (int o = 0; o < r.c; ++o) {
    for (int y = 0; y < r.h; ++y) {
      for (int x = 0; x < r.w; ++x) {
        double sum = static_cast<double>(bias[static_cast<size_t>(o)]);
        for (int i = 0; i < in.c; ++i) {
          for (int v = 0; v < kernel; ++v) {
            for (int u = 0; u < kernel; ++u) {
              const int yy = y * stride + v - padding, xx = x * stride + u - padding;
              if (yy < 0 || yy >= in.h || xx < 0 || xx >= in.w) continue;
              sum += in.at(i, yy, xx) *
                     static_cast<double>(weight[static_cast<size_t>(((o * in.c + i) * kernel + v) * kernel + u)]);
            }
          }
        }
        r.v.push_back(std::max(0.0, sum));
      }
    }
  }
  return r;
}

// Windows that begin inside the picture; `partial` ones too.
Planes Pool(const Planes& in, int kernel, bool partial) {
  const auto size = [&](int side) {
    int count = 0;
    while (2 * count + (partial ? 3 : kernel) - (partial ? 1 : 0) <= side) ++count;  // one pixel may lie outside
    return count;
  };
  Planes r{in.c, size(in.h), size(in.w), {}};
  for (int k = 0; k < r.c; ++k) {
    for (int y = 0; y < r.h; ++y) {
      for (int x = 0; x < r.w; ++x) {
        double most = -1;
        for (int yy = 2 * y; yy < std::min(in.h, 2 * y + kernel); ++yy) {
          for (int xx = 2 * x; xx < std::min(in.w, 2 * x + kernel); ++xx) most = std::max(most, in.at(k, yy, xx));
        }
        r.v.push_back(most);
      }
    }
  }
  return r;
}

std::vector<Planes> ReferenceFeatures(const LpipsWeights& weights, const Image& image) {
  Planes x{3, image.height, image.width, {}};
  const double mean[] = {0.485, 0.456, 0.406}, deviation[] = {0.229, 0.224, 0.225};  // ImageNet's
  for (int c = 0; c < 3; ++c) {
    for (int64_t i = 0; i < image.plane(); ++i) {
      // LPIPS rounds 2·mean − 1 to three digits: −0.03, −0.088, −0.188.
      const double shift = std::round((2 * mean[c] - 1) * 1000) / 1000;
      x.v.push_back((2 * static_cast<double>(image.channel(c)[i]) - 1 - shift) / (2 * deviation[c]));
    }
  }
  size_t at = 0;
  const auto convolve = [&](const Planes& in, int kernel, int stride, int padding) {
    at += 2;
    return ConvolveRelu(in, weights.tensors[at - 2], weights.tensors[at - 1], kernel, stride, padding);
  };
  std::vector<Planes> compared;
  if (weights.net == LpipsNet::kAlex) {
    compared.push_back(x = convolve(x, 11, 4, 2));
    compared.push_back(x = convolve(Pool(x, 3, false), 5, 1, 2));
    compared.push_back(x = convolve(Pool(x, 3, false), 3, 1, 1));
    compared.push_back(x = convolve(x, 3, 1, 1));
    compared.push_back(x = convolve(x, 3, 1, 1));
  } else if (weights.net == LpipsNet::kVgg) {
    for (const int layers : {2, 2, 3, 3, 3}) {
      if (!compared.empty()) x = Pool(x, 2, false);
      for (int k = 0; k < layers; ++k) x = convolve(x, 3, 1, 1);
      compared.push_back(x);
    }
  } else {
    const auto fire = [&] {
      const Planes narrow = convolve(x, 1, 1, 0);
      x = convolve(narrow, 1, 1, 0);
      const Planes wide = convolve(narrow, 3, 1, 1);
      x.v.insert(x.v.end(), wide.v.begin(), wide.v.end());
      x.c += wide.c;
    };
    compared.push_back(x = convolve(x, 3, 2, 0));
    for (const int fires : {2, 2, 1}) {
      x = Pool(x, 3, true);
      for (int k = 0; k < fires; ++k) fire();
      compared.push_back(x);
    }
    for (int k = 0; k < 3; ++k) {
      fire();
      compared.push_back(x);
    }
  }
  return compared;
}

double ReferenceDistance(const LpipsWeights& weights, const Image& a, const Image& b) {
  const std::vector<Planes> fa = ReferenceFeatures(weights, a), fb = ReferenceFeatures(weights, b);
  double total = 0;
  for (size_t k = 0; k < fa.size(); ++k) {
    const Buffer<float>& head = weights.tensors[weights.tensors.size() - fa.size() + k];
    const size_t plane = static_cast<size_t>(fa[k].h * fa[k].w);
    double sum = 0;
    for (size_t i = 0; i < plane; ++i) {
      double na = 0, nb = 0;
      for (size_t c = 0; c < head.size(); ++c) {
        na += fa[k].v[c * plane + i] * fa[k].v[c * plane + i];
        nb += fb[k].v[c * plane + i] * fb[k].v[c * plane + i];
      }
      for (size_t c = 0; c < head.size(); ++c) {
        const double difference =
            fa[k].v[c * plane + i] / (std::sqrt(na) + 1e-10) - fb[k].v[c * plane + i] / (std::sqrt(nb) + 1e-10);
        sum += static_cast<double>(head[c]) * difference * difference;
      }
    }
    total += sum / static_cast<double>(plane);
  }
  return total;
}

// ---- Fixtures.

LpipsNetwork MakeNetwork(const LpipsWeights& weights) {
  std::vector<std::span<const float>> tensors(weights.tensors.begin(), weights.tensors.end());
  auto network = LpipsNetwork::Make(weights.net, tensors);
  EXPECT_TRUE(network.ok());
  return *std::move(network);
}

// Something with edges and slopes; `other` moves and tints it.
Image Picture(int width, int height, bool other) {
  Image image(width, height, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int shifted = x + (other ? 2 : 0);
        const double wave = 0.5 + 0.4 * std::sin(0.7 * shifted + 0.3 * y + c);
        image.at(c, y, x) = static_cast<float>((shifted / 5 + y / 7) % 2 == 0 ? wave : 0.2 * c + (other ? 0.1 : 0.0));
      }
    }
  }
  return image;
}

at::Tensor Tensor(const Image& image) {
  return at::from_blob(const_cast<float*>(image.pixels.data()), {1, 3, image.height, image.width}, at::kFloat).clone();
}

TEST(LpipsNetwork, MatchesPlainLoops) {
  for (const LpipsNet net : kNets) {
    const LpipsWeights weights = SyntheticLpipsWeights(net);
    // Sizes that divide nothing; the second leaves one pixel or two at the end.
    for (const auto& [width, height] :
         {std::pair{45, 38}, std::pair{SmallestLpipsSide(net), SmallestLpipsSide(net) + 9}}) {
      const Image a = Picture(width, height, false), b = Picture(width, height, true);
      const double expected = ReferenceDistance(weights, a, b);
      EXPECT_GT(expected, 1e-3) << LpipsNetName(net);  // else it would say nothing
      const LpipsNetwork network = MakeNetwork(weights);
      EXPECT_NEAR(network.Distance(Tensor(a), Tensor(b)).item<double>(), expected, 2e-5 * expected)
          << LpipsNetName(net) << " " << width << " x " << height;
      EXPECT_NEAR(network.Distance(network.Features(Tensor(a)), network.Features(Tensor(b))).item<double>(), expected,
                  2e-5 * expected);
    }
  }
}

TEST(LpipsNetwork, EqualPicturesAreAtZeroAndBatchesDoNotMix) {
  for (const LpipsNet net : kNets) {
    const LpipsNetwork network = MakeNetwork(SyntheticLpipsWeights(net));
    const at::Tensor a = Tensor(Picture(40, 40, false)), b = Tensor(Picture(40, 40, true));
    EXPECT_EQ(network.Distance(a, a).item<double>(), 0);
    const at::Tensor pair = network.Distance(at::cat({a, a}), at::cat({b, a}));
    ASSERT_EQ(pair.sizes(), at::IntArrayRef({2}));
    EXPECT_NEAR(pair[0].item<double>(), network.Distance(a, b).item<double>(), 1e-6);
    EXPECT_EQ(pair[1].item<double>(), 0);
  }
}

TEST(LpipsNetwork, GradientMatchesDifferenceQuotient) {
  for (const LpipsNet net : kNets) {
    LpipsNetwork network = MakeNetwork(SyntheticLpipsWeights(net));
    network.To(at::kDouble);
    const at::Tensor truth = Tensor(Picture(36, 33, true)).to(at::kDouble);
    // Grain, because a pool over equal values has no derivative.
    Image start = Picture(36, 33, false);
    Random random(5);
    for (float& value : start.pixels) value += static_cast<float>(random.Uniform(-0.05, 0.05));
    at::Tensor x = Tensor(start).to(at::kDouble).requires_grad_(true);
    network.Distance(x, truth).sum().backward();
    const at::Tensor direction = at::sin(at::arange(x.numel(), at::kDouble)).view(x.sizes());
    const double slope = (x.grad() * direction).sum().item<double>();
    const c10::NoGradGuard no_gradients;
    const double step = 1e-8;  // few ReLUs and pools change sides within it
    const double quotient =
        (network.Distance(x + step * direction, truth) - network.Distance(x - step * direction, truth)).item<double>() /
        (2 * step);
    EXPECT_GT(std::abs(slope), 1e-4) << LpipsNetName(net);
    EXPECT_NEAR(slope, quotient, 1e-3 * std::abs(slope)) << LpipsNetName(net);
  }
}

TEST(LpipsNetwork, DeadFeaturesHaveFiniteGradients) {
  LpipsWeights weights = SyntheticLpipsWeights(LpipsNet::kSqueeze);
  std::fill(weights.tensors[1].begin(), weights.tensors[1].end(),
            -1e6f);  // no ReLU of the first layer lets anything by
  const LpipsNetwork network = MakeNetwork(weights);
  at::Tensor x = Tensor(Picture(40, 40, false)).requires_grad_(true);
  const at::Tensor distance = network.Distance(x, Tensor(Picture(40, 40, true)));
  distance.sum().backward();
  EXPECT_EQ(distance.item<double>(), 0);
  EXPECT_EQ(x.grad().abs().max().item<double>(), 0);  // NaN would not be equal
}

TEST(LpipsNetwork, RefusesOtherTensors) {
  const LpipsWeights weights = SyntheticLpipsWeights(LpipsNet::kAlex);
  std::vector<std::span<const float>> tensors(weights.tensors.begin(), weights.tensors.end());
  EXPECT_FALSE(LpipsNetwork::Make(LpipsNet::kVgg, tensors).ok());
  tensors[3] = tensors[3].first(5);
  EXPECT_FALSE(LpipsNetwork::Make(LpipsNet::kAlex, tensors).ok());
}

TEST(LpipsPlugin, SaysWhatTheNetworkSays) {
  for (const LpipsNet net : kNets) {
    const LpipsWeights weights = SyntheticLpipsWeights(net);
    const auto lpips = Lpips::Open(weights, ANCHORSPLAT_LPIPS_PLUGIN);
    ASSERT_TRUE(lpips.ok()) << lpips.error().message;
    const Image a = Picture(45, 38, false), b = Picture(45, 38, true);
    const auto distance = lpips->Distance(a, b);
    ASSERT_TRUE(distance.ok()) << distance.error().message;
    const double direct = MakeNetwork(weights).Distance(Tensor(a), Tensor(b)).item<double>();
    EXPECT_NEAR(*distance, direct, 1e-5 * direct);
    EXPECT_EQ(lpips->Distance(a, b).value(), *distance);  // `b` is known now
    EXPECT_EQ(lpips->Distance(a, a).value(), 0);
    EXPECT_EQ(lpips->Distance(a, b).value(), *distance);
    // The smallest pictures still work, smaller ones and others are refused.
    const int side = SmallestLpipsSide(net);
    EXPECT_TRUE(lpips->Distance(Picture(side, side, false), Picture(side, side, true)).ok());
    EXPECT_FALSE(lpips->Distance(Picture(side, side - 1, false), Picture(side, side - 1, true)).ok());
    EXPECT_FALSE(lpips->Distance(a, Picture(45, 39, true)).ok());
    EXPECT_FALSE(lpips->Distance(Image(45, 38, 1), Image(45, 38, 1)).ok());
  }
}

}  // namespace
}  // namespace anchorsplat

#include "upscale/convolution.h"

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "core/parallel.h"
#include "core/simd_targets_for_test.h"
#include "upscale/pixel_shuffle.h"
#include "upscale/plain_layers_for_test.h"

namespace anchorsplat {
namespace {

PlainMap RandomMap(int64_t channels, int64_t height, int64_t width, Random& random) {
  PlainMap out(channels, height, width);
  for (double& value : out.values) value = static_cast<float>(random.Uniform(-2, 2));
  return out;
}

FeatureMap AsFeatures(const PlainMap& plain) {
  FeatureMap out;
  out.Reshape(plain.width, plain.height, plain.channels);
  for (int64_t y = 0; y < plain.height; ++y) {
    for (int64_t x = 0; x < plain.width; ++x) {
      for (int64_t c = 0; c < plain.channels; ++c) out.pixel(x, y)[c] = static_cast<float>(plain.get(c, y, x));
    }
  }
  return out;
}

void ExpectNear(const FeatureMap& map, const PlainMap& plain) {
  ASSERT_EQ(map.channels(), plain.channels);
  for (int64_t y = 0; y < plain.height; ++y) {
    for (int64_t x = 0; x < plain.width; ++x) {
      for (int64_t c = 0; c < plain.channels; ++c) {
        ASSERT_NEAR(map.pixel(x, y)[c], plain.get(c, y, x), 2e-5) << "channel " << c << " at " << x << ", " << y;
      }
    }
  }
  for (int64_t x = -1; x <= plain.width; ++x) {  // the ring is what the next layer sees
    for (int64_t c = 0; c < plain.channels; ++c) ASSERT_EQ(map.pixel(x, -1)[c], 0) << x;
  }
}

PackedWeights Packed(const PlainTensor& weights, const PlainTensor& bias) {
  return PackConvolution(weights.values.data(), bias.values.data(), weights.shape[0], weights.shape[1],
                         weights.shape[2]);
}

TEST(Convolution, MatchesThePlainOneForEveryRemainder) {
  ForEachSimdTarget([] {
    Random random(1);
    for (const int64_t side : {1, 3}) {
      for (const int64_t width : {1, 2, 5, 6, 13, 14, 15, 29}) {
        for (const int64_t outputs : {1, 15, 16, 17, 32, 48}) {
          const PlainMap in = RandomMap(width % 2 == 0 ? 3 : 19, 3, width, random);
          const PlainTensor weights = RandomTensor({outputs, in.channels, side, side}, 0.2, random);
          const PlainTensor bias = RandomTensor({outputs}, 1, random);
          const FeatureMap features = AsFeatures(in);
          const PackedWeights packed = Packed(weights, bias);
          const ConvolutionInput input{&features, &packed};
          FeatureMap out;
          out.Reshape(width, 3, outputs);
          ConvolutionCpu({.inputs = {&input, 1}, .out = &out});
          SCOPED_TRACE(testing::Message() << side << " wide, " << width << " pixels, " << outputs << " outputs");
          ExpectNear(out, PlainConvolution(in, weights, bias));
        }
      }
    }
  });
}

TEST(Convolution, ActivationsOnWholeAndPartialPanels) {
  ForEachSimdTarget([] {
    Random random(2);
    for (const int64_t outputs : {3, 21, 48}) {
      const PlainMap in = RandomMap(4, 5, 9, random), gated = RandomMap(outputs, 5, 9, random);
      const PlainTensor weights = RandomTensor({outputs, 4, 3, 3}, 0.5, random);
      const PlainTensor bias = RandomTensor({outputs}, 1, random), slopes = RandomTensor({outputs}, 1, random);
      const FeatureMap features = AsFeatures(in), partner = AsFeatures(gated);
      const PackedWeights packed = Packed(weights, bias);
      const ConvolutionInput input{&features, &packed};
      FeatureMap out;
      out.Reshape(9, 5, outputs);
      const PlainMap sums = PlainConvolution(in, weights, bias);
      ConvolutionCpu(
          {.inputs = {&input, 1}, .activation = MapActivation::kSlope, .slopes = slopes.values.data(), .out = &out});
      ExpectNear(out, PlainSlope(sums, slopes));
      ConvolutionCpu({.inputs = {&input, 1}, .activation = MapActivation::kSilu, .out = &out});
      ExpectNear(out, PlainSilu(sums));
      ConvolutionCpu({.inputs = {&input, 1}, .activation = MapActivation::kGate, .gated = &partner, .out = &out});
      ExpectNear(out, PlainGate(sums, gated));
    }
  });
}

// Where e^x has no float any more.
TEST(Convolution, GatesFarOut) {
  ForEachSimdTarget([] {
    PlainMap in(1, 1, 6);
    in.values = {-1e30, -200, -88, 88, 200, 1e30};
    const PlainTensor weights{{1, 1, 1, 1}, {1}}, bias{{1}, {0}};
    const FeatureMap features = AsFeatures(in);
    const PackedWeights packed = Packed(weights, bias);
    const ConvolutionInput input{&features, &packed};
    FeatureMap out;
    out.Reshape(6, 1, 1);
    ConvolutionCpu({.inputs = {&input, 1}, .activation = MapActivation::kSilu, .out = &out});
    for (int64_t x = 1; x < 3; ++x) EXPECT_NEAR(out.pixel(x, 0)[0], 0, 1e-30);
    EXPECT_LE(std::abs(out.pixel(0, 0)[0]), 1e-6f);
    EXPECT_EQ(out.pixel(3, 0)[0], 88);
    EXPECT_EQ(out.pixel(5, 0)[0], 1e30f);
  });
}

TEST(Convolution, SeveralInputsAreTheirConcatenation) {
  Random random(3);
  const PlainMap a = RandomMap(3, 4, 17, random), b = RandomMap(20, 4, 17, random);
  const PlainTensor of_a = RandomTensor({18, 3, 3, 3}, 0.3, random), of_b = RandomTensor({18, 20, 3, 3}, 0.3, random);
  const PlainTensor bias = RandomTensor({18}, 1, random);
  PlainTensor both{{18, 23, 3, 3}, {}};
  for (size_t o = 0; o < 18; ++o) {
    both.values.insert(both.values.end(), &of_a.values[o * 27], &of_a.values[o * 27] + 27);
    both.values.insert(both.values.end(), &of_b.values[o * 180], &of_b.values[o * 180] + 180);
  }
  const FeatureMap maps[] = {AsFeatures(a), AsFeatures(b)};
  const PackedWeights weights[] = {Packed(of_a, bias), Packed(of_b, bias)};
  const ConvolutionInput inputs[] = {{&maps[0], &weights[0]}, {&maps[1], &weights[1]}};
  FeatureMap out;
  out.Reshape(17, 4, 18);
  ConvolutionCpu({.inputs = inputs, .out = &out});
  ExpectNear(out, PlainConvolution(PlainConcatenation({&a, &b}), both, bias));
}

TEST(Convolution, TransposedIsFourPhasesShuffled) {
  Random random(4);
  const PlainMap in = RandomMap(7, 5, 6, random);
  const PlainTensor weights = RandomTensor({7, 3, 4, 4}, 0.3, random), bias = RandomTensor({3}, 1, random);
  const FeatureMap features = AsFeatures(in);
  const PackedWeights packed = PackTransposedConvolution(weights.values.data(), bias.values.data(), 3, 7);
  const ConvolutionInput input{&features, &packed};
  FeatureMap phases;
  phases.Reshape(6, 5, 12);
  ConvolutionCpu({.inputs = {&input, 1}, .out = &phases});
  Image image(12, 10, 3);
  PixelShuffle(phases, {0, 0, 6, 5}, 2, 0, 0, image);
  const PlainMap expected = PlainTransposedConvolution(in, weights, bias);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 12; ++x) ASSERT_NEAR(image.at(c, y, x), expected.get(c, y, x), 1e-5) << c << y << x;
    }
  }
}

TEST(PixelShuffle, TakesABoxAndPutsItWhereItBelongs) {
  Random random(5);
  const PlainMap map = RandomMap(18, 4, 5, random);
  const PlainMap expected = PlainShuffle(map, 3);
  Image out(7, 7, 2);
  std::fill(out.pixels.begin(), out.pixels.end(), -9.0f);
  PixelShuffle(AsFeatures(map), {2, 1, 4, 3}, 3, 1, 0, out);
  for (int c = 0; c < 2; ++c) {
    for (int y = 0; y < 7; ++y) {
      for (int x = 0; x < 7; ++x) {
        const bool inside = x >= 1 && y < 6;
        ASSERT_EQ(out.at(c, y, x), inside ? static_cast<float>(expected.get(c, y + 3, x - 1 + 6)) : -9.0f) << x << y;
      }
    }
  }
}

TEST(Convolution, SameBitsForAnyNumberOfThreads) {
  Random random(6);
  const FeatureMap features = AsFeatures(RandomMap(48, 40, 61, random));
  const PlainTensor weights = RandomTensor({48, 48, 3, 3}, 0.1, random), bias = RandomTensor({48}, 1, random);
  const PackedWeights packed = Packed(weights, bias);
  const ConvolutionInput input{&features, &packed};
  FeatureMap one, many;
  one.Reshape(61, 40, 48);
  many.Reshape(61, 40, 48);
  SetThreadCount(1);
  ConvolutionCpu({.inputs = {&input, 1}, .activation = MapActivation::kSilu, .out = &one});
  for (const int threads : {2, 5}) {
    SetThreadCount(threads);
    ConvolutionCpu({.inputs = {&input, 1}, .activation = MapActivation::kSilu, .out = &many});
    EXPECT_EQ(0, std::memcmp(one.pixel(-1, -1), many.pixel(-1, -1), sizeof(float) * 42 * 63 * 48)) << threads;
  }
  SetThreadCount(0);
}

}  // namespace
}  // namespace anchorsplat

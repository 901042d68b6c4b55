#include <algorithm>
#include <array>
#include <utility>

#include "core/text.h"
#include "upscale/architecture.h"
#include "upscale/convolution.h"
#include "upscale/layers.h"

namespace anchorsplat {

namespace {

constexpr int kBlocks = 6;

class Span : public UpscaleArchitecture {
 public:
  PackedWeights first, second, upsampler;
  std::array<std::array<PackedWeights, 3>, kBlocks> blocks;
  std::array<PackedWeights, 4> joined;  // conv_cat, split into quarters of its inputs

  // conv_1, three per block, conv_2 and the upsampler.
  int radius() const override { return 1 + 3 * kBlocks + 2; }
  int continued() const override { return 0; }
  int64_t floats_per_pixel() const override { return 3 + 6 * first.outputs() + upsampler.outputs(); }

  double multiply_adds_per_pixel() const override {
    double sum = MultiplyAdds(first) + MultiplyAdds(second) + MultiplyAdds(upsampler);
    for (const auto& block : blocks) {
      for (const PackedWeights& weights : block) sum += MultiplyAdds(weights);
    }
    for (const PackedWeights& weights : joined) sum += MultiplyAdds(weights);
    return sum;
  }

  const FeatureMap& Run(const FeatureMap& input, std::vector<FeatureMap>& maps) const override {
    maps.resize(7);
    for (FeatureMap& map : maps) map.Reshape(input.width(), input.height(), first.outputs());
    FeatureMap &features = maps[0], &once = maps[1], &twice = maps[2], &of_first = maps[3];
    FeatureMap& enlarged = maps[6];
    const auto convolve = [](const FeatureMap& in, const PackedWeights& weights, MapActivation activation,
                             const FeatureMap* gated, FeatureMap& out) {
      const ConvolutionInput one{&in, &weights};
      ConvolutionCpu({.inputs = {&one, 1}, .activation = activation, .gated = gated, .out = &out});
    };
    convolve(input, first, MapActivation::kNone, nullptr, features);
    const FeatureMap* x = &features;
    for (int b = 0; b < kBlocks; ++b) {
      FeatureMap& out = b == 0 ? of_first : maps[static_cast<size_t>(4 + b % 2)];
      const auto& block = blocks[static_cast<size_t>(b)];
      convolve(*x, block[0], MapActivation::kSilu, nullptr, once);
      convolve(once, block[1], MapActivation::kSilu, nullptr, twice);
      convolve(twice, block[2], MapActivation::kGate, x, out);
      x = &out;
    }
    convolve(*x, second, MapActivation::kNone, nullptr, twice);
    FeatureMap& all = x == &maps[4] ? maps[5] : maps[4];
    const std::array<ConvolutionInput, 4> inputs = {
        {{&features, &joined[0]}, {&twice, &joined[1]}, {&of_first, &joined[2]}, {&once, &joined[3]}}};
    ConvolutionCpu({.inputs = inputs, .out = &all});
    enlarged.Reshape(input.width(), input.height(), upsampler.outputs());
    convolve(all, upsampler, MapActivation::kNone, nullptr, enlarged);
    return enlarged;
  }
};

// Inputs [from, from + count) of a 1×1 convolution; only the first part has the bias.
PackedWeights PackInputs(const ConvolutionValues& values, int64_t from, int64_t count) {
  Buffer<float> part(static_cast<size_t>(values.outputs * count));
  for (int64_t o = 0; o < values.outputs; ++o) {
    std::copy_n(values.weights.data() + o * values.inputs + from, count, part.data() + o * count);
  }
  return PackConvolution(part.data(), values.bias.data(), values.outputs, count, 1);
}

}  // namespace

Result<std::unique_ptr<UpscaleArchitecture>> MakeSpan(int scale, const TensorFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t channels, ReadOutputs(file, "conv_1"));
  auto span = std::make_unique<Span>();
  const auto read = [&](const std::string& name, int64_t outputs, int64_t inputs, PackedWeights& out) -> Status {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ConvolutionValues values, ReadConvolution(file, name, outputs, inputs, 3));
    out = Packed(values, 3);
    return {};
  };
  ANCHORSPLAT_RETURN_IF_ERROR(read("conv_1", channels, 3, span->first));
  for (int b = 0; b < kBlocks; ++b) {
    for (int c = 0; c < 3; ++c) {
      ANCHORSPLAT_RETURN_IF_ERROR(read(Cat("block_", b + 1, ".c", c + 1, "_r"), channels, channels,
                                       span->blocks[static_cast<size_t>(b)][static_cast<size_t>(c)]));
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(read("conv_2", channels, channels, span->second));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ConvolutionValues joined,
                               ReadConvolution(file, "conv_cat", channels, 4 * channels, 1));
  for (size_t part = 0; part < span->joined.size(); ++part) {
    span->joined[part] = PackInputs(joined, static_cast<int64_t>(part) * channels, channels);
  }
  ANCHORSPLAT_RETURN_IF_ERROR(read("upsampler", int64_t{3} * scale * scale, channels, span->upsampler));
  return std::unique_ptr<UpscaleArchitecture>(std::move(span));
}

}  // namespace anchorsplat

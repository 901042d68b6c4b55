#include <algorithm>
#include <utility>

#include "core/text.h"
#include "upscale/architecture.h"
#include "upscale/convolution.h"
#include "upscale/layers.h"

namespace anchorsplat {

namespace {

// A chain of convolutions, each but the last followed by its channels' slopes for negative values.
class Chain : public UpscaleArchitecture {
 public:
  struct Layer {
    PackedWeights weights;
    Buffer<float> slopes;  // [outputs]; empty for the last
  };
  std::vector<Layer> layers;

  int radius() const override { return static_cast<int>(layers.size()); }
  // waifu2x networks have no padding: they crop by their receptive field, so padding at map borders has no effect.
  int continued() const override { return radius(); }
  int64_t floats_per_pixel() const override {
    int64_t widest[2] = {0, 0};
    for (size_t k = 0; k < layers.size(); ++k) widest[k % 2] = std::max(widest[k % 2], layers[k].weights.outputs());
    return 3 + widest[0] + widest[1];
  }

  double multiply_adds_per_pixel() const override {
    double sum = 0;
    for (const Layer& layer : layers) sum += MultiplyAdds(layer.weights);
    return sum;
  }

  const FeatureMap& Run(const FeatureMap& input, std::vector<FeatureMap>& maps) const override {
    maps.resize(2);
    const FeatureMap* x = &input;
    for (size_t k = 0; k < layers.size(); ++k) {
      const Layer& layer = layers[k];
      FeatureMap& out = maps[k % 2];
      out.Reshape(input.width(), input.height(), layer.weights.outputs());
      const ConvolutionInput one{x, &layer.weights};
      ConvolutionCpu({.inputs = {&one, 1},
                      .activation = layer.slopes.empty() ? MapActivation::kNone : MapActivation::kSlope,
                      .slopes = layer.slopes.data(),
                      .out = &out});
      x = &out;
    }
    return *x;
  }
};

// Reads conv.0 to conv.{count − 1}; the first has `inputs` inputs.
Result<std::vector<ConvolutionValues>> ReadChain(const TensorFile& file, int count, int64_t inputs,
                                                 std::vector<Buffer<float>>& slopes) {
  std::vector<ConvolutionValues> out;
  for (int k = 0; k < count; ++k) {
    const std::string name = Cat("conv.", k);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t outputs, ReadOutputs(file, name));
    ANCHORSPLAT_ASSIGN_OR_RETURN(out.emplace_back(), ReadConvolution(file, name, outputs, inputs, 3));
    ANCHORSPLAT_ASSIGN_OR_RETURN(slopes.emplace_back(), ReadFinite(file, name + ".slope", {outputs}));
    inputs = outputs;
  }
  return out;
}

// Folds constant input maps (after the three colours) into the bias.
void FoldConstants(const Buffer<float>& constants, ConvolutionValues& values) {
  const auto count = static_cast<int64_t>(constants.size());
  Buffer<float> of_colors(static_cast<size_t>(values.outputs * 3 * 9));
  for (int64_t o = 0; o < values.outputs; ++o) {
    const float* weights = values.weights.data() + o * values.inputs * 9;
    double sum = values.bias[static_cast<size_t>(o)];
    for (int64_t k = 0; k < count; ++k) {
      for (int64_t tap = 0; tap < 9; ++tap) {
        sum += double{constants[static_cast<size_t>(k)]} * double{weights[(3 + k) * 9 + tap]};
      }
    }
    values.bias[static_cast<size_t>(o)] = static_cast<float>(sum);
    std::copy_n(weights, 27, of_colors.data() + o * 27);
  }
  values.inputs = 3;
  values.weights = std::move(of_colors);
}

std::unique_ptr<Chain> Assemble(const std::vector<ConvolutionValues>& convolutions, std::vector<Buffer<float>> slopes) {
  auto chain = std::make_unique<Chain>();
  for (size_t k = 0; k < convolutions.size(); ++k) {
    chain->layers.push_back({Packed(convolutions[k], 3), std::move(slopes[k])});
  }
  return chain;
}

}  // namespace

Result<std::unique_ptr<UpscaleArchitecture>> MakeUpconv7(int scale, const TensorFile& file) {
  if (scale != 2) return Error{ErrorCode::kBadFile, Cat(file.name(), ": upconv_7 has the scale 2, not ", scale)};
  std::vector<Buffer<float>> slopes;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto convolutions, ReadChain(file, 6, 3, slopes));
  const int64_t inputs = convolutions.back().outputs;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto weights, ReadFinite(file, "up.weight", {inputs, 3, 4, 4}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto bias, ReadFinite(file, "up.bias", {3}));
  auto chain = Assemble(convolutions, std::move(slopes));
  chain->layers.push_back({PackTransposedConvolution(weights.data(), bias.data(), 3, inputs), {}});
  return std::unique_ptr<UpscaleArchitecture>(std::move(chain));
}

Result<std::unique_ptr<UpscaleArchitecture>> MakeSrmd(int scale, const TensorFile& file) {
  constexpr int kLayers = 12;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* entry, file.Require("constants"));
  const int64_t count = entry->elements();
  if (count > kMostMapChannels) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": more than ", kMostMapChannels, " constants")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto constants, ReadFinite(file, "constants", {count}));
  std::vector<Buffer<float>> slopes;
  ANCHORSPLAT_ASSIGN_OR_RETURN(auto convolutions, ReadChain(file, kLayers - 1, 3 + count, slopes));
  FoldConstants(constants, convolutions.front());
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const ConvolutionValues last,
      ReadConvolution(file, Cat("conv.", kLayers - 1), int64_t{3} * scale * scale, convolutions.back().outputs, 3));
  auto chain = Assemble(convolutions, std::move(slopes));
  chain->layers.push_back({Packed(last, 3), {}});
  return std::unique_ptr<UpscaleArchitecture>(std::move(chain));
}

}  // namespace anchorsplat

#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/text.h"
#include "io/folder_for_test.h"
#include "tensors/safetensors.h"
#include "upscale/plain_layers_for_test.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

// A network of random numbers, and its file.
struct SmallUpscaler {
  std::map<std::string, std::string> metadata;
  std::map<std::string, PlainTensor> tensors;

  Status Write(const std::filesystem::path& path) const {
    std::vector<TensorEntry> entries;
    for (const auto& [name, tensor] : tensors) {
      entries.push_back(MakeEntry(name, tensor.shape, std::span<const float>(tensor.values)));
    }
    return WriteSafetensors(path, entries, metadata, {.overwrite = true});
  }
};

// The network after a round trip through a file.
inline Upscaler OpenedForTest(const SmallUpscaler& network) {
  const TestFolder folder;
  EXPECT_TRUE(network.Write(folder / "network.safetensors").ok());
  auto out = Upscaler::Read(folder / "network.safetensors");
  EXPECT_TRUE(out.ok()) << out.error().message;
  return *std::move(out);
}

inline SmallUpscaler UpscalerForTest(const std::string& architecture, int scale, Random& random) {
  SmallUpscaler out;
  out.metadata = {{"format", kUpscalerFormat}, {"architecture", architecture}, {"scale", Cat(scale)},
                  {"color_space", "sRGB"},     {"input_range", "0-1"},         {"source", "a test"},
                  {"licence", "Apache-2.0"}};
  out.tensors["input.mean"] = RandomTensor({3}, 0.3, random);
  out.tensors["input.scale"] = {{1}, {1.5f}};
  return out;
}

// Adds a convolution to `out`, scaled to preserve the magnitude of activations.
inline void AddConvolution(SmallUpscaler& out, const std::string& name, int64_t outputs, int64_t inputs, int64_t side,
                           Random& random) {
  const double spread = 2 / std::sqrt(static_cast<double>(inputs * side * side));
  out.tensors[name + ".weight"] = RandomTensor({outputs, inputs, side, side}, spread, random);
  out.tensors[name + ".bias"] = RandomTensor({outputs}, 0.2, random);
}

inline SmallUpscaler SpanForTest(int64_t channels = 5, int scale = 3) {
  Random random(7);
  SmallUpscaler out = UpscalerForTest("span-1", scale, random);
  AddConvolution(out, "conv_1", channels, 3, 3, random);
  for (int b = 1; b <= 6; ++b) {
    for (int c = 1; c <= 3; ++c) AddConvolution(out, Cat("block_", b, ".c", c, "_r"), channels, channels, 3, random);
  }
  AddConvolution(out, "conv_2", channels, channels, 3, random);
  AddConvolution(out, "conv_cat", channels, 4 * channels, 1, random);
  AddConvolution(out, "upsampler", int64_t{3} * scale * scale, channels, 3, random);
  return out;
}

// Adds conv.{0…} with these numbers of channels; the first has `inputs` inputs.
inline int64_t AddChain(SmallUpscaler& out, const std::vector<int64_t>& channels, int64_t inputs, Random& random) {
  for (size_t k = 0; k < channels.size(); ++k) {
    AddConvolution(out, Cat("conv.", k), channels[k], inputs, 3, random);
    out.tensors[Cat("conv.", k, ".slope")] = RandomTensor({channels[k]}, 0.5, random);
    inputs = channels[k];
  }
  return inputs;
}

inline SmallUpscaler Upconv7ForTest() {
  Random random(8);
  SmallUpscaler out = UpscalerForTest("upconv_7-1", 2, random);
  const int64_t inputs = AddChain(out, {2, 4, 3, 17, 4, 6}, 3, random);
  out.tensors["up.weight"] = RandomTensor({inputs, 3, 4, 4}, 0.4, random);
  out.tensors["up.bias"] = RandomTensor({3}, 0.2, random);
  return out;
}

inline SmallUpscaler SrmdForTest() {
  Random random(9);
  SmallUpscaler out = UpscalerForTest("srmd-1", 2, random);
  out.tensors["constants"] = RandomTensor({4}, 1, random);
  AddChain(out, std::vector<int64_t>(11, 5), 7, random);
  AddConvolution(out, "conv.11", 12, 5, 3, random);
  return out;
}

// A network that repeats each pixel four times.
inline SmallUpscaler RepeatingForTest() {
  Random random(10);
  SmallUpscaler out = UpscalerForTest("srmd-1", 2, random);
  out.tensors["input.mean"] = {{3}, {0, 0, 0}};
  out.tensors["input.scale"] = {{1}, {1}};
  out.tensors["constants"] = {{1}, {0}};
  for (size_t k = 0; k < 12; ++k) {
    const size_t outputs = k == 11 ? 12 : 3, inputs = k == 0 ? 4 : 3, per_color = outputs / 3;
    PlainTensor weights{{static_cast<int64_t>(outputs), static_cast<int64_t>(inputs), 3, 3},
                        std::vector<float>(outputs * inputs * 9)};
    for (size_t o = 0; o < outputs; ++o) weights.values[(o * inputs + o / per_color) * 9 + 4] = 1;
    out.tensors[Cat("conv.", k, ".weight")] = weights;
    out.tensors[Cat("conv.", k, ".bias")] = {{static_cast<int64_t>(outputs)}, std::vector<float>(outputs)};
    if (k < 11) out.tensors[Cat("conv.", k, ".slope")] = {{3}, {0, 0, 0}};
  }
  return out;
}

}  // namespace anchorsplat

#include "perceptual/lpips_net.h"

#include <array>

#include "core/text.h"

namespace anchorsplat {

namespace {

using Kind = LpipsStep::Kind;

constexpr std::array<LpipsNet, 3> kNets = {LpipsNet::kAlex, LpipsNet::kVgg, LpipsNet::kSqueeze};

LpipsStep Convolution(int index, int in, int out, int kernel, int stride, int padding, bool compared) {
  return {.kind = Kind::kConvolution,
          .index = index,
          .in = in,
          .out = out,
          .kernel = kernel,
          .stride = stride,
          .padding = padding,
          .compared = compared};
}

LpipsStep MaxPool(int kernel, bool ceil) {
  return {.kind = Kind::kMaxPool, .kernel = kernel, .stride = 2, .ceil = ceil};
}

LpipsStep Fire(int index, int in, int squeezed, int out, bool compared) {
  return {.kind = Kind::kFire,
          .index = index,
          .in = in,
          .out = out,
          .kernel = 1,
          .squeezed = squeezed,
          .compared = compared};
}

std::vector<LpipsStep> Alex() {
  return {Convolution(0, 3, 64, 11, 4, 2, true),   MaxPool(3, false),
          Convolution(3, 64, 192, 5, 1, 2, true),  MaxPool(3, false),
          Convolution(6, 192, 384, 3, 1, 1, true), Convolution(8, 384, 256, 3, 1, 1, true),
          Convolution(10, 256, 256, 3, 1, 1, true)};
}

std::vector<LpipsStep> Vgg() {
  std::vector<LpipsStep> steps;
  int in = 3, index = 0;
  for (const auto& [channels, layers] : {std::pair{64, 2}, {128, 2}, {256, 3}, {512, 3}, {512, 3}}) {
    if (!steps.empty()) {
      steps.push_back(MaxPool(2, false));
      ++index;
    }
    for (int layer = 0; layer < layers; ++layer) {
      steps.push_back(Convolution(index, in, channels, 3, 1, 1, layer + 1 == layers));
      in = channels;
      index += 2;  // torchvision counts ReLUs too
    }
  }
  return steps;
}

std::vector<LpipsStep> Squeeze() {
  return {Convolution(0, 3, 64, 3, 2, 0, true),
          MaxPool(3, true),
          Fire(3, 64, 16, 128, false),
          Fire(4, 128, 16, 128, true),
          MaxPool(3, true),
          Fire(6, 128, 32, 256, false),
          Fire(7, 256, 32, 256, true),
          MaxPool(3, true),
          Fire(9, 256, 48, 384, true),
          Fire(10, 384, 48, 384, true),
          Fire(11, 384, 64, 512, true),
          Fire(12, 512, 64, 512, true)};
}

void AddConvolution(std::vector<LpipsTensorSpec>& tensors, const std::string& name, int in, int out, int kernel) {
  tensors.push_back({name + ".weight", {out, in, kernel, kernel}});
  tensors.push_back({name + ".bias", {out}});
}

}  // namespace

const char* LpipsNetName(LpipsNet net) {
  switch (net) {
    case LpipsNet::kAlex:
      return "alex";
    case LpipsNet::kVgg:
      return "vgg";
    case LpipsNet::kSqueeze:
      return "squeeze";
  }
  return "unknown";
}

std::optional<LpipsNet> FindLpipsNet(std::string_view name) {
  for (const LpipsNet net : kNets) {
    if (name == LpipsNetName(net)) return net;
  }
  return std::nullopt;
}

const std::vector<LpipsStep>& LpipsSteps(LpipsNet net) {
  static const std::array<std::vector<LpipsStep>, kNets.size()> steps = {Alex(), Vgg(), Squeeze()};
  return steps[static_cast<size_t>(net)];
}

std::vector<LpipsTensorSpec> LpipsTensors(LpipsNet net) {
  std::vector<LpipsTensorSpec> tensors;
  std::vector<int> compared;
  for (const LpipsStep& step : LpipsSteps(net)) {
    const std::string name = Cat("features.", step.index);
    if (step.kind == Kind::kConvolution) AddConvolution(tensors, name, step.in, step.out, step.kernel);
    if (step.kind == Kind::kFire) {
      AddConvolution(tensors, name + ".squeeze", step.in, step.squeezed, 1);
      AddConvolution(tensors, name + ".expand1x1", step.squeezed, step.out / 2, 1);
      AddConvolution(tensors, name + ".expand3x3", step.squeezed, step.out / 2, 3);
    }
    if (step.compared) compared.push_back(step.out);
  }
  for (size_t k = 0; k < compared.size(); ++k) {
    tensors.push_back({Cat("lin", k, ".model.1.weight"), {1, compared[k], 1, 1}});
  }
  return tensors;
}

int SmallestLpipsSide(LpipsNet net) {
  for (int smallest = 1;; ++smallest) {
    int side = smallest;
    for (const LpipsStep& step : LpipsSteps(net)) {
      if (step.kind == Kind::kFire || side < 1) continue;
      const int room = side + 2 * step.padding - step.kernel;
      // Pools with `ceil` still start inside, and ours always get at least one window.
      side = room < 0 ? 0 : (room + (step.ceil ? step.stride - 1 : 0)) / step.stride + 1;
    }
    if (side >= 1) return smallest;
  }
}

}  // namespace anchorsplat

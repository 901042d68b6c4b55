#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace anchorsplat {

// The image classifiers whose features LPIPS compares (Zhang et al. 2018): "alex" is the one papers report, "vgg" the
// one to train against, "squeeze" the smallest.
enum class LpipsNet { kAlex, kVgg, kSqueeze };

const char* LpipsNetName(LpipsNet net);                       // "alex", "vgg", "squeeze"
std::optional<LpipsNet> FindLpipsNet(std::string_view name);  // nothing for any other word

// One step of a classifier's feature extractor; all convolutions are followed by ReLU.
struct LpipsStep {
  enum class Kind { kConvolution, kMaxPool, kFire };
  Kind kind = Kind::kConvolution;
  int index = 0;  // of the layer in torchvision's `features`, part of its tensors' names; unused by pools
  int in = 0;     // channels
  int out = 0;    // channels; a fire module gives half of them through 1×1 and half through 3×3 kernels
  int kernel = 0;
  int stride = 1;
  int padding = 0;
  int squeezed = 0;       // fire modules: channels between
  bool ceil = false;      // pools: the last window may reach over the edge
  bool compared = false;  // LPIPS compares what comes out here
};

// From the picture to the last layer compared (AlexNet: Krizhevsky 2014, "one weird trick", five ReLUs; VGG16: relu1_2,
// 2_2, 3_3, 4_3, 5_3; SqueezeNet 1.1: the first ReLU, then where its seven feature sizes end).
const std::vector<LpipsStep>& LpipsSteps(LpipsNet net);

// The tensors a network needs under the names of their publishers: torchvision's "features.N.…" of the classifier, and
// the weights per channel "linK.model.1.weight" [1,C,1,1] of LPIPS 0.1.
struct LpipsTensorSpec {
  std::string name;
  std::vector<int64_t> shape;
};
std::vector<LpipsTensorSpec> LpipsTensors(LpipsNet net);

// Height or width of the smallest square picture of which something is left at the last layer.
int SmallestLpipsSide(LpipsNet net);

}  // namespace anchorsplat

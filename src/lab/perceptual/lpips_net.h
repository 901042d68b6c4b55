#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace anchorsplat {

// Image classifiers whose features LPIPS compares (Zhang et al. 2018): "alex" is reported in papers, "vgg" suits
// training, "squeeze" is the smallest.
enum class LpipsNet { kAlex, kVgg, kSqueeze };

const char* LpipsNetName(LpipsNet net);                       // "alex", "vgg", "squeeze"
std::optional<LpipsNet> FindLpipsNet(std::string_view name);  // unset for unknown names

// A step of a classifier's feature extractor; every convolution is followed by ReLU.
struct LpipsStep {
  enum class Kind { kConvolution, kMaxPool, kFire };
  Kind kind = Kind::kConvolution;
  int index = 0;  // of the layer in torchvision's `features`, part of its tensor names; unused by pools
  int in = 0;     // channels
  int out = 0;    // channels; half of a fire module's come from 1×1 and half from 3×3 kernels
  int kernel = 0;
  int stride = 1;
  int padding = 0;
  int squeezed = 0;       // fire modules: intermediate channels
  bool ceil = false;      // pools: the last window may extend over the edge
  bool compared = false;  // LPIPS compares this step's output
};

// Steps from the picture to the last compared layer (AlexNet: Krizhevsky 2014, "one weird trick", five ReLUs; VGG16:
// relu1_2, 2_2, 3_3, 4_3, 5_3; SqueezeNet 1.1: the first ReLU, then the end of each of its seven feature sizes).
const std::vector<LpipsStep>& LpipsSteps(LpipsNet net);

// Tensors of a network under their publishers' names: torchvision's "features.N.…", and LPIPS 0.1's weights per channel
// "linK.model.1.weight" [1,C,1,1].
struct LpipsTensorSpec {
  std::string name;
  std::vector<int64_t> shape;
};
std::vector<LpipsTensorSpec> LpipsTensors(LpipsNet net);

// Side of the smallest square picture for which the last layer is not empty.
int SmallestLpipsSide(LpipsNet net);

}  // namespace anchorsplat

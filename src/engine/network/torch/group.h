#pragma once

#include <torch/torch.h>

namespace anchorsplat {

// An empty module that only names its submodules.
class GroupImpl : public torch::nn::Module {};
TORCH_MODULE(Group);

}  // namespace anchorsplat

#pragma once

#include <torch/torch.h>

namespace anchorsplat {

// A module that only holds others, to give them their names.
class GroupImpl : public torch::nn::Module {};
TORCH_MODULE(Group);

}  // namespace anchorsplat

#include "network/torch/trainable_network.h"

namespace anchorsplat {

Result<std::shared_ptr<const void>> TrainableNetwork::Survey(const NetworkInput&) {
  return Error{ErrorCode::kBadArgument, "this network needs the whole splat: it cannot work on parts"};
}

void TrainableNetwork::ShareMemory(const std::function<void(torch::Tensor&)>&) {}

SplatPart TrainableNetwork::PartOf(const std::shared_ptr<const void>&, std::span<const int64_t>) { return {}; }

}  // namespace anchorsplat

#pragma once

#include <memory>

#include "core/result.h"
#include "network/torch/network_options.h"
#include "network/torch/trainable_network.h"

namespace anchorsplat {

// The published network for training. Errors: those of MakeTrainableNetwork (model/torch/make_trainable_network.h).
Result<std::shared_ptr<TrainableNetwork>> MakePublishedTrainable(const NetworkOptions& options);

}  // namespace anchorsplat

#pragma once

#include <memory>

#include "core/result.h"
#include "network/torch/network_options.h"
#include "network/torch/trainable_network.h"

namespace anchorsplat {

// Makes a compact network for training. Options: those of VisitCompactOptions, and `init`, a file for InitialiseFrom.
// Errors: those of MakeTrainableNetwork (model/torch/make_trainable_network.h).
Result<std::shared_ptr<TrainableNetwork>> MakeCompactTrainable(NetworkOptions options);

}  // namespace anchorsplat

#pragma once

#include <memory>
#include <string>

#include "core/result.h"
#include "network/torch/network_options.h"
#include "network/torch/trainable_network.h"

namespace anchorsplat {

// Makes a network of kind "anchorsplat" or "compact" with fresh parameters (torch's generator).
// Errors (kBadArgument): an unknown kind; an option that the kind lacks or of the wrong type.
Result<std::shared_ptr<TrainableNetwork>> MakeTrainableNetwork(const std::string& kind, const NetworkOptions& options);

}  // namespace anchorsplat

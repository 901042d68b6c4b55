#pragma once

#include <memory>
#include <string>

#include "core/result.h"
#include "model/shared/torch/network_options.h"
#include "model/shared/torch/trainable_network.h"

namespace anchorsplat {

// A network of the given kind with fresh parameters (torch's generator): "anchorsplat" or "compact".
// Errors (kBadArgument): an unknown kind; an option that the kind does not have or of another type.
Result<std::shared_ptr<TrainableNetwork>> MakeTrainableNetwork(const std::string& kind, const NetworkOptions& options);

}  // namespace anchorsplat

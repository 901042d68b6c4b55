#include "model/modules/trainable_network.h"

#include "core/text.h"

namespace anchorsplat {

// One function per kind, each in the file of its network.
Result<std::shared_ptr<TrainableNetwork>> MakeAnchorSplatTrainable(const NetworkOptions& options);
Result<std::shared_ptr<TrainableNetwork>> MakeCompactTrainable(NetworkOptions options);

Result<std::shared_ptr<const void>> TrainableNetwork::Survey(const NetworkInput&) {
  return Error{ErrorCode::kBadArgument, "this network sees a splat as a whole: it cannot work on parts"};
}

void TrainableNetwork::ShareMemory(const std::function<void(torch::Tensor&)>&) {}

SplatPart TrainableNetwork::PartOf(const std::shared_ptr<const void>&, std::span<const int64_t>) { return {}; }

Result<std::shared_ptr<TrainableNetwork>> MakeTrainableNetwork(const std::string& kind, const NetworkOptions& options) {
  if (kind == "anchorsplat") return MakeAnchorSplatTrainable(options);
  if (kind == "compact") return MakeCompactTrainable(options);
  return Error{ErrorCode::kBadArgument,
               Cat("kind: there is no network \"", Printable(kind), "\" (anchorsplat and compact are)")};
}

}  // namespace anchorsplat

#include "model/torch/make_trainable_network.h"

#include "compact/torch/compact_trainable.h"
#include "core/text.h"
#include "published/torch/published_trainable.h"

namespace anchorsplat {

Result<std::shared_ptr<TrainableNetwork>> MakeTrainableNetwork(const std::string& kind, const NetworkOptions& options) {
  if (kind == "anchorsplat") return MakePublishedTrainable(options);
  if (kind == "compact") return MakeCompactTrainable(options);
  return Error{ErrorCode::kBadArgument,
               Cat("kind: unknown network \"", Printable(kind), "\" (known: anchorsplat, compact)")};
}

}  // namespace anchorsplat

#include "compact/torch/compact_trainable.h"

#include <string>
#include <utility>
#include <variant>

#include "compact/torch/compact_module.h"

namespace anchorsplat {

Result<std::shared_ptr<TrainableNetwork>> MakeCompactTrainable(NetworkOptions options) {
  std::string init;
  if (const auto given = options.find("init"); given != options.end()) {
    const std::string* path = std::get_if<std::string>(&given->second);
    if (path == nullptr)
      return Error{ErrorCode::kBadArgument, "init: expected the path of a compact network's weights"};
    init = *path;
    options.erase(given);
  }
  CompactConfig config;
  OptionReader reader(std::move(options));
  VisitCompactOptions(config, reader);
  ANCHORSPLAT_RETURN_IF_ERROR(reader.Finish());
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(config));
  const auto network = std::make_shared<CompactTrainable>(config);
  if (!init.empty()) ANCHORSPLAT_RETURN_IF_ERROR(network->InitialiseFrom(init));
  return std::static_pointer_cast<TrainableNetwork>(network);
}

}  // namespace anchorsplat

#include "model/model_method.h"

#include <optional>
#include <utility>

#include "enhance/enhance.h"
#include "model/checkpoint.h"

namespace anchorsplat {

void RegisterModelMethod(const std::shared_ptr<const ModelMethod>& method) {
  const auto network = std::make_shared<std::optional<PackedNetwork>>();
  RegisterEnhanceMethod(
      {.name = "model",
       .summary = "one pass of the AnchorSplat network of --model",
       .rank = 1,
       .needs_pixel_size = false,
       .ready = [method](const EnhanceOptions&) -> Status {
         if (!method->file.empty()) return {};
         return Error{ErrorCode::kBadArgument, "the method 'model' needs a checkpoint: --model FILE"};
       },
       .run = [method, network](const EnhanceInput& input, const EnhanceOptions&) -> Result<GaussianCloud> {
         if (!*network) {
           ANCHORSPLAT_ASSIGN_OR_RETURN(*network, LoadNetwork(method->file, method->precision));
         }
         ANCHORSPLAT_ASSIGN_OR_RETURN(ModelResult result, EnhanceWithModel(input.cloud, **network, method->options));
         return std::move(result.cloud);
       }});
}

}  // namespace anchorsplat

#include "model/model_method.h"

#include <optional>
#include <utility>

#include "enhance/enhance.h"
#include "model/checkpoint.h"

namespace anchorsplat {

void RegisterModelMethod(const std::shared_ptr<const ModelMethod>& method) {
  const auto network = std::make_shared<std::optional<PackedNetwork>>();
  RegisterEnhanceMethod({.name = "model",
                         .summary = "one pass of the AnchorSplat network of --model",
                         .rank = 1,
                         .needs_pixel_size = false,
                         .ready = [method](const EnhanceOptions&) -> Status {
                           if (!method->file.empty()) return {};
                           return Error{ErrorCode::kBadArgument, "the method 'model' needs a checkpoint: --model FILE"};
                         },
                         .run = [method, network](const EnhanceInput& input, const EnhanceOptions&,
                                                  EnhanceReport& report) -> Result<GaussianCloud> {
                           if (!*network) {
                             ANCHORSPLAT_ASSIGN_OR_RETURN(*network, LoadNetwork(method->file, method->precision));
                           }
                           ANCHORSPLAT_ASSIGN_OR_RETURN(ModelResult result,
                                                        EnhanceWithModel(input.cloud, **network, method->options));
                           const ModelReport& r = result.report;
                           report.dropped += r.not_finite + r.outside;
                           report.facts = {{"over_limit", static_cast<double>(r.over_limit)},
                                           {"anchors", static_cast<double>(r.anchors)},
                                           {"output_not_finite", static_cast<double>(r.output_not_finite)},
                                           {"pruned", static_cast<double>(r.pruned)},
                                           {"blocks", static_cast<double>(r.blocks)}};
                           return std::move(result.cloud);
                         }});
}

}  // namespace anchorsplat

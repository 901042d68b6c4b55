#include "enhance/enhance.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bindings.h"
#include "columns.h"
#include "core/splat_comments.h"
#include "core/world_up.h"
#include "fit/checkpoint_guard.h"
#include "fit/fitter.h"
#include "model/model_method.h"
#include "request/device_flags.h"
#include "request/enhance_flags.h"
#include "request/words.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

EnhanceFlags FlagsOf(const nb::list& words) {
  EnhanceFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  OrThrow(ParseWords(verb, WordsOf(words)));
  flags.options.given = GivenOptions(verb);
  return flags;
}

Result<Enhanced> EnhanceView(const CloudView& view, const EnhanceFlags& flags, const CameraSet* cameras,
                             uint64_t seed) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const EnhanceOptions options, MakeEnhanceOptions(flags, seed, cameras));
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(view));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const MethodPlan plan, PlanEnhancement(options));
  const auto checkpoint = plan.KeepsCheckpoint(options) ? options.control.checkpoint : std::filesystem::path();
  if (!checkpoint.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(
        CheckCheckpoint(checkpoint, {}, options.control.resume, /*overwrite=*/false, plan.method->is_checkpoint));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto lock, HoldCheckpoint(checkpoint));
  GaussianCloud cloud = CopyOf(view);
  ANCHORSPLAT_ASSIGN_OR_RETURN(Enhanced enhanced, Enhance(std::move(cloud), options));
  if (enhanced.report.interrupted) return Error{ErrorCode::kInterrupted, "stopped"};
  if (!checkpoint.empty()) RemoveCheckpoint(checkpoint, plan.method->is_checkpoint);
  if (options.cameras && !UpOf(enhanced.cloud.comments)) {
    if (const auto up = WorldUp(options.cameras->cameras)) enhanced.cloud.comments.push_back(UpComment(*up));
  }
  return enhanced;
}

nb::tuple EnhanceCloud(nb::handle cloud, const nb::list& words, const CameraSet* cameras, uint64_t seed,
                       const RunArguments& run) {
  const Columns columns(cloud);
  const EnhanceFlags flags = FlagsOf(words);
  nlohmann::json used;
  Enhanced enhanced = ResultOf(run, [&]() -> Result<Enhanced> {
    const DeviceUse device;
    ANCHORSPLAT_ASSIGN_OR_RETURN(Enhanced made, EnhanceView(columns.view(), flags, cameras, seed));
    used = device.ToJson();
    return made;
  });
  nlohmann::json json = ToJson(enhanced.report);
  json["device"] = used;
  const std::string report = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return nb::make_tuple(ToPython(std::move(enhanced.cloud)), report);
}

}  // namespace

void BindEnhance(nb::module_& module) {
  module.def("enhance", &EnhanceCloud, nb::arg("cloud").none(), nb::arg("words"), nb::arg("cameras").none(),
             nb::arg("seed"), nb::arg("run"));
  module.def("enhance_methods", [] {
    std::vector<std::pair<std::string, std::string>> methods;
    for (const EnhanceMethod& method : AllMethods()) methods.emplace_back(method.name, method.summary);
    nb::list list;
    for (const auto& [name, summary] : methods) list.append(nb::make_tuple(name, summary));
    return list;
  });
}

}  // namespace anchorsplat::python

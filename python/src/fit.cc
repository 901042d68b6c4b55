#include "fit/fit.h"

#include <nanobind/stl/string.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "bindings.h"
#include "columns.h"
#include "core/log.h"
#include "core/text.h"
#include "fit/checkpoint_guard.h"
#include "fit/training_views.h"
#include "request/device_flags.h"
#include "request/fit_flags.h"
#include "request/words.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

struct Outcome {
  GaussianCloud cloud;
  std::string report;
};

Result<Outcome> FitTo(const std::string& project, const FitFlags& flags, const GaussianCloud* start, uint64_t seed) {
  const DeviceUse device;
  FitControl control;
  control.checkpoint = flags.checkpoint;
  control.checkpoint_every = flags.checkpoint_every;
  control.resume = flags.resume;
  if (flags.checkpoint.empty() && (flags.resume || flags.checkpoint_every > 0)) {
    return Error{ErrorCode::kBadArgument, Cat(flags.resume ? "--resume" : "--checkpoint-every",
                                              " has no effect here; it works only with --checkpoint")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TrainingViews views,
                               OpenProject(project, {.hold_out = flags.hold_out, .downscale = flags.downscale}));
  if (!control.checkpoint.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckCheckpoint(control.checkpoint, {}, control.resume, /*overwrite=*/false));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto lock, HoldCheckpoint(control.checkpoint));
  ANCHORSPLAT_ASSIGN_OR_RETURN(FitOptions options, MakeFitOptions(flags, views.background, seed));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ChosenStart chosen, ChooseFitStart(flags, views, project, seed, start));
  ANCHORSPLAT_ASSIGN_OR_RETURN(FirstGaussians first, MakeFirstGaussians(flags, views, chosen, options));
  LogInfo(Cat(views.train.size(), " training views, ", views.held_out.size(), " held out, scene scale ",
              Fixed(views.scene_scale, 3), ", ", WithThousands(first.cloud.size()), " initial Gaussians"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Fitted fitted, Fit(views, std::move(first.cloud), options, control));
  if (fitted.report.interrupted) return Error{ErrorCode::kInterrupted, "stopped"};
  nlohmann::json json = ToJson(options, chosen.origin, first.shell, fitted.report);
  json["project"] = project;
  json["device"] = device.ToJson();
  return Outcome{std::move(fitted.cloud), json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
}

nb::tuple FitProject(const nb::bytes& project, const nb::list& words, nb::handle start, uint64_t seed,
                     const RunArguments& run) {
  FitFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  OrThrow(ParseWords(verb, WordsOf(words)));
  flags.given = GivenOptions(verb);
  std::optional<Columns> columns;
  if (!start.is_none()) columns.emplace(start);
  const std::string folder = PathOf(project);
  Outcome outcome = ResultOf(run, [&]() -> Result<Outcome> {
    std::optional<GaussianCloud> splat;
    if (columns) {
      ANCHORSPLAT_RETURN_IF_ERROR(Validate(columns->view()));
      splat = CopyOf(columns->view());
    }
    return FitTo(folder, flags, splat ? &*splat : nullptr, seed);
  });
  return nb::make_tuple(ToPython(std::move(outcome.cloud)), outcome.report);
}

}  // namespace

void BindFit(nb::module_& module) {
  module.def("fit", &FitProject, nb::arg("project"), nb::arg("words"), nb::arg("start").none(), nb::arg("seed"),
             nb::arg("run"));
}

}  // namespace anchorsplat::python

#include "web/edits.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <iterator>
#include <span>
#include <string>
#include <utility>

#include "core/cloud_view.h"
#include "core/similarity.h"
#include "core/text.h"
#include "edit/edit_clouds.h"
#include "edit/edit_plan.h"
#include "request/edit_flags.h"
#include "request/words.h"

namespace anchorsplat::web {

namespace {

// A splat before its first edit. `rows` and `extras` must outlive it.
EditedSplat Unedited(const CloudView& cloud, RowSource& rows, const ExtraProperties& extras) {
  return {.name = "the splat",
          .rows = &rows,
          .extras = &extras,
          .origin = cloud.origin,
          .sh_degree = cloud.sh_degree,
          .kept = cloud.size()};
}

// The map from old to new world coordinates.
Result<Similarity> WorldAfter(const std::vector<EditAction>& actions) {
  std::vector<EditAction> moves;
  std::ranges::copy_if(actions, std::back_inserter(moves), [](const EditAction& action) {
    return std::holds_alternative<MoveWorld>(action.what) || std::holds_alternative<TurnToUp>(action.what);
  });
  const GaussianCloud nothing;
  const ExtraProperties none;
  MemoryRows rows(nothing, none);
  EditedSplat splat = Unedited(nothing, rows, none);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto steps, ApplyActions(std::span(&splat, 1), moves, ""));
  return splat.world;
}

}  // namespace

Result<Edits> EditsOf(const Json& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<std::string> words, WordsOf(request));
  EditFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  ANCHORSPLAT_RETURN_IF_ERROR(ParseWords(verb, std::move(words)));
  ANCHORSPLAT_ASSIGN_OR_RETURN(auto actions, ActionsAmongPaths(flags));
  return Edits{std::move(actions[0]), flags.dry_run};
}

Result<Edited> EditCloud(const GaussianCloud& cloud, const std::vector<EditAction>& actions) {
  const std::array<CloudView, 1> clouds = {cloud};
  const std::array<EditRun, 1> runs = {EditRun{0, 1, actions}};
  ANCHORSPLAT_ASSIGN_OR_RETURN(EditedCloud edited, EditClouds(clouds, runs));
  if (edited.cloud.size() == 0) return Error{ErrorCode::kBadArgument, "the edits leave nothing of the splat"};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Similarity world, WorldAfter(actions));
  Json report = {{"actions", anchorsplat::ToJson(edited.steps)},
                 {"world", {{"rotation", world.rotation}, {"translation", world.translation}, {"scale", world.scale}}}};
  return Edited{std::move(edited.cloud), std::move(report)};
}

Result<Json> CountEdits(const GaussianCloud& cloud, const std::vector<EditAction>& actions) {
  const ExtraProperties none;
  MemoryRows rows(cloud, none);
  EditedSplat splat = Unedited(cloud, rows, none);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto steps, ApplyActions(std::span(&splat, 1), actions, ""));
  return anchorsplat::ToJson(steps);
}

}  // namespace anchorsplat::web

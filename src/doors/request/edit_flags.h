#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "edit/action.h"
#include "edit/edit_plan.h"

namespace anchorsplat {

// The actions on splats as options of a verb, whose order counts.
struct EditFlags {
  std::string axes = std::string(kTypedActionAxes);
  bool dry_run = false;
  const CLI::App* verb = nullptr;
  const CLI::Option* paths = nullptr;  // of the verb: files, among which actions stand; null: it has none
  std::vector<CLI::Option*> options;   // in the order of ActionNames
  CLI::Option* axes_option = nullptr;

  void AddTo(CLI::App& on);
};

// What was asked for, in its order. One list more than there are paths: those before the first path, behind the first
// one, and so on. Errors: kBadArgument with the action, or where --action-axes has no effect.
Result<std::vector<std::vector<EditAction>>> ActionsAmongPaths(const EditFlags& flags);

// RDF, LUF and so on, of --action-axes. Errors: kBadArgument.
Result<Axes> ParseActionAxes(const std::string& name);

// What each action did, as --json and Python say it: a list.
nlohmann::json ToJson(std::span<const EditStep> steps);

}  // namespace anchorsplat

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

// Edits of splats as options of a verb. Their order matters.
struct EditFlags {
  std::string axes = std::string(kTypedActionAxes);
  bool dry_run = false;
  const CLI::App* verb = nullptr;
  const CLI::Option* paths = nullptr;  // the verb's files, between which edits may stand; null: none
  std::vector<CLI::Option*> options;   // in the order of ActionNames
  CLI::Option* axes_option = nullptr;

  void AddTo(CLI::App& on);
};

// The edits in order, in one list more than there are paths: before the first path, after the first path, and so on.
// Errors: kBadArgument with the edit, or if --action-axes has no effect.
Result<std::vector<std::vector<EditAction>>> ActionsAmongPaths(const EditFlags& flags);

// Parses --action-axes, such as RDF or LUF. Errors: kBadArgument.
Result<Axes> ParseActionAxes(const std::string& name);

// What each edit did, a list for --json and Python.
nlohmann::json ToJson(std::span<const EditStep> steps);

}  // namespace anchorsplat

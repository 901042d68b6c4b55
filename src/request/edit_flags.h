#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "edit/action.h"

namespace anchorsplat {

// The actions on splats as options of a verb, whose order counts.
struct EditFlags {
  std::string axes = "RDF";
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

}  // namespace anchorsplat

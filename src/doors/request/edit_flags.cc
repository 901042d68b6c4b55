#include "request/edit_flags.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/text.h"
#include "formats/axes.h"
#include "request/choice.h"

namespace anchorsplat {

void EditFlags::AddTo(CLI::App& on) {
  verb = &on;
  const std::string group = "Edits, applied in the order given";
  for (const ActionName& action : ActionNames()) {
    const std::string names(action.options), help(action.help);
    // Not bound to variables: ActionsAmongPaths reads values and positions after parsing.
    CLI::Option* const option = !action.form.empty()
                                    ? on.add_option(names, CLI::callback_t(), help)
                                          ->type_size(1)
                                          ->expected(1, CLI::detail::expected_max_vector_size)
                                          ->allow_extra_args(false)
                                          ->type_name(std::string(action.form))
                                    : on.add_flag(names, help)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    option->group(group);
    options.push_back(option);
  }
  axes_option = on.add_option("--action-axes", axes,
                              "Axes of the edits' numbers. LUF: x left, y up, z forward, as in splat-transform. "
                              "RDF: as in info, --region and --target")
                    ->type_name("AXES")
                    ->check(NotEmpty())
                    ->capture_default_str()
                    ->group(group);
  on.add_flag("--dry-run", dry_run, "Write nothing; report how many Gaussians each edit would remove")->group(group);
}

Result<Axes> ParseActionAxes(const std::string& name) {
  if (const std::optional<Axes> axes = AxesFromName(name)) return *axes;
  return Error{ErrorCode::kBadArgument, Cat("--action-axes: \"", Printable(name),
                                            "\" is not a set of axes. Expected one each of R or L, U or D and F or B, "
                                            "such as RDF or LUF")};
}

nlohmann::json ToJson(std::span<const EditStep> steps) {
  nlohmann::json json = nlohmann::json::array();
  for (const EditStep& step : steps) {
    nlohmann::json row = {{"action", step.action}, {"taken", step.taken}, {"left", step.left}};
    if (!step.input.empty()) row["input"] = step.input;
    if (!step.axes.empty()) row["axes"] = step.axes;
    json.push_back(std::move(row));
  }
  return json;
}

Result<std::vector<std::vector<EditAction>>> ActionsAmongPaths(const EditFlags& flags) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Axes axes, ParseActionAxes(flags.axes));
  std::vector<std::vector<EditAction>> actions(1);
  std::map<const CLI::Option*, size_t> seen;
  bool any = false;
  for (const CLI::Option* const option : flags.verb->parse_order()) {
    if (option == flags.paths) {
      actions.emplace_back();
      continue;
    }
    const auto found = std::ranges::find(flags.options, option);
    if (found == flags.options.end()) continue;
    const ActionName& name = ActionNames()[static_cast<size_t>(found - flags.options.begin())];
    const std::vector<std::string> words = option->results();
    const size_t at = seen[option]++;
    ANCHORSPLAT_ASSIGN_OR_RETURN(EditAction action, ParseAction(name.name, at < words.size() ? words[at] : "", axes));
    actions.back().push_back(std::move(action));
    any = true;
  }
  if (!any && flags.axes_option->count() > 0) {
    return Error{ErrorCode::kBadArgument,
                 "--action-axes has no effect here; it works only with edits such as --translate"};
  }
  return actions;
}

}  // namespace anchorsplat

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings.h"
#include "columns.h"
#include "edit/edit_clouds.h"
#include "request/edit_flags.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

// The first cloud that it is done to, how many, "--translate", its value, "RDF".
using Step = std::tuple<size_t, size_t, std::string, std::string, std::string>;

Result<EditAction> ActionOf(const Step& step) {
  const auto& [first, count, name, text, axes_name] = step;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Axes axes, ParseActionAxes(axes_name));
  return ParseAction(name, text, axes);
}

// Steps that follow each other on the same clouds are one run, which looks at the rows once.
std::vector<EditRun> RunsOf(const std::vector<Step>& steps) {
  std::vector<EditRun> runs;
  for (const Step& step : steps) {
    const size_t first = std::get<0>(step), count = std::get<1>(step);
    if (runs.empty() || runs.back().first != first || runs.back().count != count) runs.push_back({first, count});
    runs.back().actions.push_back(OrThrow(ActionOf(step)));
  }
  return runs;
}

nb::tuple EditColumns(const nb::list& clouds, const std::vector<Step>& steps, const RunArguments& run) {
  std::vector<std::unique_ptr<Columns>> columns;
  std::vector<CloudView> views;
  int64_t gaussians = 0;
  int degree = 0;
  for (const nb::handle cloud : clouds) {
    columns.push_back(std::make_unique<Columns>(cloud));
    views.push_back(columns.back()->view());
    gaussians += views.back().size();
    degree = std::max(degree, views.back().sh_degree);
  }
  const std::vector<EditRun> runs = RunsOf(steps);
  EditedCloud edited = ResultOf(run, [&] { return EditClouds(views, runs); });
  const nlohmann::json json = {{"gaussians", {{"in", gaussians}, {"out", edited.cloud.size()}}},
                               {"sh_degree", {{"in", degree}, {"out", edited.cloud.sh_degree}}},
                               {"actions", ToJson(std::span<const EditStep>(edited.steps))}};
  const std::string text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return nb::make_tuple(ToPython(std::move(edited.cloud)), text);
}

}  // namespace

void BindEdit(nb::module_& module) {
  module.def("edit", &EditColumns, nb::arg("clouds"), nb::arg("steps"), nb::arg("run"));
  // (name, help, form of its value) of every action; no form: it may do without a value.
  module.def("edit_names", [] {
    nb::list list;
    for (const ActionName& action : ActionNames()) {
      list.append(nb::make_tuple(std::string(action.name), std::string(action.help), std::string(action.form)));
    }
    return list;
  });
  // Throws where an action is none, before it is done.
  module.def("check_edit", [](const std::string& name, const std::string& text, const std::string& axes) {
    (void)OrThrow(ActionOf({0, 1, name, text, axes}));
  });
}

}  // namespace anchorsplat::python

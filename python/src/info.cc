#include <nanobind/stl/string.h>

#include <nlohmann/json.hpp>
#include <string>

#include "bindings.h"
#include "columns.h"
#include "formats/opened_splat.h"
#include "request/findings.h"
#include "request/parse.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

std::string Text(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string InfoPath(const nb::bytes& path, const std::string& format, const RunArguments& run) {
  const std::string name = PathOf(path);
  return ResultOf(run, [&]() -> Result<std::string> {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* const known, ParseInputFormat("format", format));
    if (known == nullptr && LooksLikeNetwork(name)) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const NetworkFindings found, InspectNetwork(name));
      return Text(ToJson(found));
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Open(name, known));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFindings found, InspectSplat(file, name));
    return Text(ToJson(found));
  });
}

std::string InfoCloud(nb::handle cloud, const RunArguments& run) {
  const Columns columns(cloud);
  return ResultOf(run, [&]() -> Result<std::string> {
    ANCHORSPLAT_RETURN_IF_ERROR(Validate(columns.view()));
    return Text(ToJson(InspectSplat(columns.view())));
  });
}

}  // namespace

void BindInfo(nb::module_& module) {
  module.def("info_path", &InfoPath, nb::arg("path"), nb::arg("format"), nb::arg("run"));
  module.def("info_cloud", &InfoCloud, nb::arg("cloud").none(), nb::arg("run"));
}

}  // namespace anchorsplat::python

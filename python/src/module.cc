#include "bindings.h"
#include "run.h"

std::vector<std::string> anchorsplat::python::WordsOf(const nanobind::list& words) {
  std::vector<std::string> out;
  for (const nanobind::handle word : words) out.push_back(PathOf(nanobind::cast<nanobind::bytes>(word)));
  return out;
}

NB_MODULE(_core, module) {
  using namespace anchorsplat::python;
  module.doc() = "The engine. For anchorsplat's own modules: it may change in every version.";
  module.attr("version") = ANCHORSPLAT_VERSION;
  nanobind::set_leak_warnings(false);  // what a program still holds when it ends is its own affair
  BindRun(module);
  BindFiles(module);
  BindEnhance(module);
  BindCameras(module);
  BindRender(module);
  BindFit(module);
  BindConvert(module);
  BindEdit(module);
  BindUpscale(module);
  BindView(module);
  BindCompare(module);
  BindRasterizer(module);
  BindInfo(module);
}

#pragma once

#include <nanobind/nanobind.h>

#include <string>
#include <vector>

namespace anchorsplat::python {

// One function per file of bindings. What they take and return is for anchorsplat/*.py, which has the names, types and
// documentation that people see: paths are bytes, options the words of the command line, reports JSON.
void BindFiles(nanobind::module_& module);
void BindEnhance(nanobind::module_& module);
void BindCameras(nanobind::module_& module);
void BindRender(nanobind::module_& module);
void BindFit(nanobind::module_& module);
void BindConvert(nanobind::module_& module);
void BindEdit(nanobind::module_& module);
void BindUpscale(nanobind::module_& module);
void BindView(nanobind::module_& module);
void BindCompare(nanobind::module_& module);
void BindRasterizer(nanobind::module_& module);
void BindInfo(nanobind::module_& module);

// Words as os.fsencode gives them: they may hold paths, which are any bytes.
std::vector<std::string> WordsOf(const nanobind::list& words);

// Paths as os.fsencode gives them.
inline std::string PathOf(const nanobind::bytes& path) { return {path.c_str(), path.size()}; }

}  // namespace anchorsplat::python

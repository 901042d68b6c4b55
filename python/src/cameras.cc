#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bindings.h"
#include "cameras/camera_checks.h"
#include "cameras/camera_io.h"
#include "columns.h"
#include "core/text.h"
#include "request/views.h"
#include "request/words.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

using Doubles = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;

nb::object ToDoubles(std::vector<double> values, const std::vector<size_t>& shape) {
  auto held = std::make_unique<std::vector<double>>(std::move(values));
  const nb::capsule owner(held.get(), [](void* memory) noexcept { delete static_cast<std::vector<double>*>(memory); });
  auto& kept = *held.release();
  static double nothing = 0;
  double* const data = kept.empty() ? &nothing : kept.data();
  return nb::cast(nb::ndarray<nb::numpy, double>(data, shape.size(), shape.data(), owner));
}

CameraSet ReadSet(const nb::bytes& path, const RunArguments& run) {
  const std::string name = PathOf(path);
  return ResultOf(run, [&] { return ReadCameras(name); });
}

// Of arrays that anchorsplat/_cameras.py has checked: sizes [V,2] as width and height, intrinsics [V,4] as fx fy cx cy,
// poses [V,4,4].
CameraSet SetOf(const std::vector<std::string>& names, const std::vector<std::pair<int, int>>& sizes,
                const Doubles& intrinsics, const Doubles& poses, std::optional<std::array<float, 3>> background) {
  CameraSet set;
  set.background = background;
  for (size_t v = 0; v < names.size(); ++v) {
    const double* const k = intrinsics.data() + 4 * v;
    const double* const m = poses.data() + 16 * v;
    Camera camera;
    camera.name = names[v];
    camera.intrinsics = {sizes[v].first, sizes[v].second, k[0], k[1], k[2], k[3]};
    camera.world_to_camera = {{m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, {m[3], m[7], m[11]}};
    set.cameras.push_back(std::move(camera));
  }
  return set;
}

CameraSet Views(nb::handle cloud, const nb::list& words, const CameraSet* cameras, const RunArguments& run) {
  const Columns columns(cloud);
  ViewFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  OrThrow(ParseWords(verb, WordsOf(words)));
  return ResultOf(run, [&]() -> Result<CameraSet> {
    ANCHORSPLAT_RETURN_IF_ERROR(Validate(columns.view()));
    return MakeViews(flags, columns.view(), cameras);
  });
}

nb::list Names(const CameraSet& set) {
  nb::list names;
  for (const Camera& camera : set.cameras) {
    names.append(
        nb::steal(PyUnicode_DecodeUTF8(camera.name.data(), static_cast<Py_ssize_t>(camera.name.size()), "replace")));
  }
  return names;
}

nb::object Intrinsics(const CameraSet& set) {
  std::vector<double> values;
  for (const Camera& camera : set.cameras) {
    const Pinhole& k = camera.intrinsics;
    values.insert(values.end(), {k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1});
  }
  return ToDoubles(std::move(values), {set.cameras.size(), 3, 3});
}

nb::object Poses(const CameraSet& set) {
  std::vector<double> values;
  for (const Camera& camera : set.cameras) {
    const auto& [r, t] = camera.world_to_camera;
    values.insert(values.end(), {r[0], r[1], r[2], t[0], r[3], r[4], r[5], t[1], r[6], r[7], r[8], t[2], 0, 0, 0, 1});
  }
  return ToDoubles(std::move(values), {set.cameras.size(), 4, 4});
}

CameraSet Chosen(const CameraSet& set, const std::vector<size_t>& rows) {
  CameraSet some;
  some.source = set.source;
  some.background = set.background;
  for (const size_t row : rows) some.cameras.push_back(set.cameras.at(row));
  return some;
}

}  // namespace

void BindCameras(nb::module_& module) {
  nb::class_<CameraSet>(module, "CameraSet")
      .def("__len__", [](const CameraSet& set) { return set.cameras.size(); })
      .def("names", &Names)
      .def("sizes",
           [](const CameraSet& set) {
             nb::list sizes;
             for (const Camera& camera : set.cameras) {
               sizes.append(nb::make_tuple(camera.intrinsics.width, camera.intrinsics.height));
             }
             return sizes;
           })
      .def("intrinsics", &Intrinsics)
      .def("poses", &Poses)
      .def("background", [](const CameraSet& set) { return set.background; })
      .def("chosen", &Chosen, nb::arg("rows"));
  module.def("read_cameras", &ReadSet, nb::arg("path"), nb::arg("run"));
  module.def("cameras_of", &SetOf, nb::arg("names"), nb::arg("sizes"), nb::arg("intrinsics"), nb::arg("poses"),
             nb::arg("background").none());
  module.def("views", &Views, nb::arg("cloud").none(), nb::arg("words"), nb::arg("cameras").none(), nb::arg("run"));
}

}  // namespace anchorsplat::python

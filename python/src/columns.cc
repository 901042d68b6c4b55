#include "columns.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>

#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <utility>

namespace anchorsplat::python {

namespace {

nb::object Lent(float* values, const std::vector<size_t>& shape, const nb::object& owner) {
  static float nothing = 0;
  return nb::cast(
      nb::ndarray<nb::numpy, float>(values == nullptr ? &nothing : values, shape.size(), shape.data(), owner));
}

// The bytes that a comment has in its file: what is no UTF-8 there are surrogates here.
std::string BytesOf(nb::handle text) {
  const nb::object encoded = nb::steal(PyUnicode_AsEncodedString(text.ptr(), "utf-8", "surrogateescape"));
  if (!encoded.is_valid()) throw nb::python_error();
  return {PyBytes_AsString(encoded.ptr()), static_cast<size_t>(PyBytes_Size(encoded.ptr()))};
}

std::optional<RenderMode> ModeOf(const nb::object& name) {
  if (name.is_none()) return std::nullopt;
  if (const auto mode = RenderModeNamed(nb::cast<std::string>(name))) return mode;
  throw nb::value_error("render_mode is none that there is");
}

}  // namespace

Columns::Columns(nb::handle cloud) {
  const char* const names[] = {"means", "log_scales", "quats", "opacity_logits", "sh"};
  std::span<const float>* const columns[] = {&view_.means, &view_.log_scales, &view_.quats, &view_.opacity_logits,
                                             &view_.sh};
  for (size_t k = 0; k < std::size(names); ++k) {
    if (!nb::hasattr(cloud, names[k])) {
      throw nb::type_error("expected an anchorsplat.Cloud");
    }
    Array array;
    if (!nb::try_cast(cloud.attr(names[k]), array, /*convert=*/false)) {
      throw nb::type_error("the arrays of a Cloud are float32, C-contiguous and in the memory of the CPU");
    }
    *columns[k] = {array.data(), array.size()};
    arrays_.push_back(std::move(array));
  }
  view_.sh_degree = nb::cast<int>(cloud.attr("sh_degree"));
  view_.render_mode = ModeOf(cloud.attr("render_mode"));
  for (const nb::handle comment : cloud.attr("comments")) comments_.push_back(BytesOf(comment));
  view_.comments = comments_;
  view_.origin = nb::cast<WorldOrigin>(cloud.attr("origin"));
}

nb::object ToArray(Buffer<float> values, const std::vector<size_t>& shape) {
  auto held = std::make_unique<Buffer<float>>(std::move(values));
  const nb::capsule owner(held.get(), [](void* memory) noexcept { delete static_cast<Buffer<float>*>(memory); });
  return Lent(held.release()->data(), shape, owner);
}

nb::tuple ToPython(GaussianCloud cloud) {
  auto held = std::make_unique<GaussianCloud>(std::move(cloud));
  const nb::capsule owner(held.get(), [](void* memory) noexcept { delete static_cast<GaussianCloud*>(memory); });
  GaussianCloud& c = *held.release();
  const auto n = static_cast<size_t>(c.size());
  nb::list comments;
  for (const std::string& comment : c.comments) {
    comments.append(
        nb::steal(PyUnicode_DecodeUTF8(comment.data(), static_cast<Py_ssize_t>(comment.size()), "surrogateescape")));
  }
  const nb::object mode = c.render_mode ? nb::cast(std::string(NameOf(*c.render_mode))) : nb::none();
  return nb::make_tuple(c.sh_degree, Lent(c.means.data(), {n, 3}, owner), Lent(c.log_scales.data(), {n, 3}, owner),
                        Lent(c.quats.data(), {n, 4}, owner), Lent(c.opacity_logits.data(), {n}, owner),
                        Lent(c.sh.data(), {n, static_cast<size_t>(c.coefficients()), 3}, owner), mode, comments,
                        nb::make_tuple(c.origin[0], c.origin[1], c.origin[2]));
}

}  // namespace anchorsplat::python

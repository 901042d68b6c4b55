#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat::python {

namespace nb = nanobind;

// The columns that an anchorsplat.Cloud lends for as long as this lives, which is as long as a call: with the
// interpreter's lock it is made and destroyed, without it `view` is read.
class Columns {
 public:
  // Throws nanobind's python_error (TypeError) for something else than a Cloud.
  explicit Columns(nb::handle cloud);
  Columns(const Columns&) = delete;
  Columns& operator=(const Columns&) = delete;

  const CloudView& view() const { return view_; }

 private:
  using Array = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;

  std::vector<Array> arrays_;
  std::vector<std::string> comments_;
  CloudView view_;
};

// (sh_degree, means, log_scales, quats, opacity_logits, sh, render_mode, comments): what Cloud is made of. The arrays
// are NumPy's and share the buffers, which live as long as one of them.
nb::tuple ToPython(GaussianCloud cloud);

// A NumPy array [shape] that owns `values`.
nb::object ToArray(Buffer<float> values, const std::vector<size_t>& shape);

}  // namespace anchorsplat::python

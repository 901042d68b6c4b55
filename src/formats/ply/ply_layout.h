#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/extra_properties.h"
#include "formats/ply/ply_header.h"
#include "io/input_file.h"

namespace anchorsplat {

// Where one float of a Gaussian goes: component `component` of the row of `array`.
struct PlyTarget {
  Buffer<float> GaussianCloud::*array = nullptr;
  int64_t width = 0;  // floats per row of the array
  int component = 0;
};

// How the rows of element "vertex" become Gaussians.
struct PlyLayout {
  const PlyElement* vertex = nullptr;  // of the header given to PlanPly
  int sh_degree = 0;
  std::vector<std::optional<PlyTarget>> targets;  // one per property of `vertex`; nothing: not of a Gaussian
  // kFilter3d, where `vertex` has one: what Mip-Splatting's program keeps beside Gaussians that its 3-D smoothing
  // filter is not yet a part of, a size each (core/smoothing_filter.h).
  std::optional<size_t> filter;
};
inline constexpr std::string_view kFilter3d = "filter_3D";

// Whether x, y or z of the file are doubles.
bool HasDoubleMeans(const PlyLayout& layout);

// Where the value of a property goes in memory, for row 0, and how far it is from there to row 1.
struct PlyDestination {
  float* number = nullptr;     // as a float
  std::byte* bytes = nullptr;  // or as it is, little-endian
  double* wide = nullptr;      // or as a double
  int64_t stride = 0;          // floats, bytes or doubles
  bool skipped() const { return number == nullptr && bytes == nullptr && wide == nullptr; }
};

// Finds the INRIA properties x y z, f_dc_0..2, f_rest_* (0, 9, 24 or 45, channel-major), opacity, scale_0..2, rot_0..3
// by name, and filter_3D, and checks that they are float or double. Errors (kBadFile) say what is missing, or what the
// file is instead. `header` must outlive the layout.
Result<PlyLayout> PlanPly(const InputFile& file, const PlyHeader& header);

// What of the file is no part of Gaussians: scalars of "vertex" become properties with room for all rows, nx ny nz
// become normals, its lists and other elements with rows are named in `not_kept`.
ExtraProperties PlanExtras(const PlyHeader& header, const PlyLayout& layout);

// One per property of `layout.vertex`. `cloud` has room for all rows, as has `filter` where the layout has one;
// `extras` is of PlanExtras, or null: skipped. Means go to `world`, [N,3], where that has room.
std::vector<PlyDestination> Destinations(const PlyLayout& layout, GaussianCloud& cloud, Buffer<double>& world,
                                         Buffer<float>& filter, ExtraProperties* extras);

}  // namespace anchorsplat

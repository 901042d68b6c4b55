#pragma once

#include <algorithm>
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
  // What other programs write in place of INRIA's properties:
  bool surfels = false;       // 2DGS has two scales only; the third axis is the normal
  float full_color = 0;       // red green blue in place of f_dc_*: what stands for full intensity; 0: there is f_dc
  bool float_color = false;   // these are floats, of which it takes all to tell that
  float full_alpha = 0;       // the same of alpha in place of opacity
  bool prefixed = false;      // CloudCompare's "scalar_" stands before their names
  std::vector<bool> dropped;  // by property: harmonics of degree 4, which are not read
  bool has_degree_4() const { return std::find(dropped.begin(), dropped.end(), true) != dropped.end(); }
  bool stored_as_read() const { return full_color == 0 && full_alpha == 0; }
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

// Makes of numbers as they are in a file what `layout` says they mean: called for rows once they are read. What can be
// done without knowing other rows.
void FinishPlyRows(const PlyLayout& layout, GaussianCloud& rows);

// Says what of the harmonics is not read.
void WarnOfPlyDegree(const InputFile& file, const PlyLayout& layout);

// Finds the INRIA properties x y z, f_dc_0..2, f_rest_* (0, 9, 24 or 45, channel-major), opacity, scale_0..2, rot_0..3
// by name, and filter_3D, and checks that they are float or double. Also what other programs have in their place: two
// scales (2DGS), red green blue without f_dc_*, a whole-number alpha without opacity, names behind CloudCompare's
// "scalar_" and "scal_", 72 f_rest_*. Errors (kBadFile) say what is missing, or what the file is instead. `header` must
// outlive the layout.
Result<PlyLayout> PlanPly(const InputFile& file, const PlyHeader& header);

// What of the file is no part of Gaussians: scalars of "vertex" become properties with room for all rows, nx ny nz
// become normals, its lists and other elements with rows are named in `not_kept`.
ExtraProperties PlanExtras(const PlyHeader& header, const PlyLayout& layout);

// One per property of `layout.vertex`. `cloud` has room for all rows, as has `filter` where the layout has one;
// `extras` is of PlanExtras, or null: skipped. Means go to `world`, [N,3], where that has room.
std::vector<PlyDestination> Destinations(const PlyLayout& layout, GaussianCloud& cloud, Buffer<double>& world,
                                         Buffer<float>& filter, ExtraProperties* extras);

}  // namespace anchorsplat

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

// Destination of one float of a Gaussian: `component` of its row in `array`.
struct PlyTarget {
  Buffer<float> GaussianCloud::*array = nullptr;
  int64_t width = 0;  // floats per row of the array
  int component = 0;
};

// Mapping from rows of element "vertex" to Gaussians.
struct PlyLayout {
  const PlyElement* vertex = nullptr;  // of the header given to PlanPly
  int sh_degree = 0;
  std::vector<std::optional<PlyTarget>> targets;  // one per property of `vertex`; none: not part of a Gaussian
  // Index of property kFilter3d, if present: the size of Mip-Splatting's 3-D smoothing filter, not yet applied to the
  // Gaussians (core/smoothing_filter.h).
  std::optional<size_t> filter;
  // Properties of other programs in place of INRIA's:
  bool surfels = false;       // two scales only (2DGS); the third axis is the normal
  float full_color = 0;       // full intensity of red green blue in place of f_dc_*; 0: f_dc exists
  bool float_color = false;   // these are floats; all values are needed to determine their range
  float full_alpha = 0;       // the same for alpha in place of opacity
  bool prefixed = false;      // names start with CloudCompare's "scalar_"
  std::vector<bool> dropped;  // per property: harmonics of degree 4, which are not read
  bool has_degree_4() const { return std::find(dropped.begin(), dropped.end(), true) != dropped.end(); }
  bool stored_as_read() const { return full_color == 0 && full_alpha == 0; }
};
inline constexpr std::string_view kFilter3d = "filter_3D";

// Whether x, y or z in the file are doubles.
bool HasDoubleMeans(const PlyLayout& layout);

// Destination of a property's value for row 0, and the step to row 1.
struct PlyDestination {
  float* number = nullptr;     // as a float
  std::byte* bytes = nullptr;  // or unchanged, little-endian
  double* wide = nullptr;      // or as a double
  int64_t stride = 0;          // floats, bytes or doubles
  bool skipped() const { return number == nullptr && bytes == nullptr && wide == nullptr; }
};

// Converts raw rows, once read, according to `layout`. Only what does not depend on other rows.
void FinishPlyRows(const PlyLayout& layout, GaussianCloud& rows);

// Warns of harmonics that are not read.
void WarnOfPlyDegree(const InputFile& file, const PlyLayout& layout);

// Finds INRIA's properties by name: x y z, f_dc_0..2, f_rest_* (0, 9, 24 or 45, channel-major), opacity, scale_0..2,
// rot_0..3, and filter_3D; all must be float or double. Also accepts variants of other programs: two scales (2DGS), red
// green blue without f_dc_*, integer alpha without opacity, names with CloudCompare's "scalar_" or "scal_", 72
// f_rest_*. Errors (kBadFile) say what is missing, or what the file is instead. `header` must outlive the layout.
Result<PlyLayout> PlanPly(const InputFile& file, const PlyHeader& header);

// Extra properties of the file: scalars of "vertex" become properties with room for all rows, nx ny nz become normals;
// its lists and other non-empty elements are listed in `not_kept`.
ExtraProperties PlanExtras(const PlyHeader& header, const PlyLayout& layout);

// Destinations, one per property of `layout.vertex`. `cloud` has room for all rows, as has `filter` if the layout has
// one. `extras` is from PlanExtras; null skips them. Means go to `world` [N,3] if it has room.
std::vector<PlyDestination> Destinations(const PlyLayout& layout, GaussianCloud& cloud, Buffer<double>& world,
                                         Buffer<float>& filter, ExtraProperties* extras);

}  // namespace anchorsplat

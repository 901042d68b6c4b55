#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/render_mode.h"
#include "core/result.h"
#include "core/world_origin.h"

namespace anchorsplat {

inline constexpr int kMaxShDegree = 3;
// Coefficients per colour channel, including the constant one: (degree + 1)².
constexpr int ShCoefficients(int degree) { return (degree + 1) * (degree + 1); }

// The one currency of the program: host memory, structure of arrays, in *stored* (pre-activation) space exactly as an
// INRIA PLY keeps it. Row i of every array belongs to Gaussian i. Plain data: use Validate() at the doors.
struct GaussianCloud {
  int sh_degree = 0;             // 0–3
  Buffer<float> means;           // [N,3] world, from `origin` on
  Buffer<float> log_scales;      // [N,3] ln(world units), one per axis of the rotation
  Buffer<float> quats;           // [N,4] wxyz, any norm, not normalised
  Buffer<float> opacity_logits;  // [N] logit(opacity)
  Buffer<float> sh;              // [N,(sh_degree+1)²,3] coefficient-major, rgb fastest; [.,0,.] is f_dc

  std::optional<RenderMode> render_mode;  // as the file says; nothing when it does not say
  std::vector<std::string> comments;      // of the file, without the tags of render mode and origin

  WorldOrigin origin = {0, 0, 0};  // world position = origin + mean
  bool double_means = false;       // a PLY of it has world coordinates in double, as the file had that it is from

  int64_t size() const { return static_cast<int64_t>(opacity_logits.size()); }
  bool empty() const { return opacity_logits.empty(); }
  int coefficients() const { return ShCoefficients(sh_degree); }
  int64_t sh_stride() const { return int64_t{3} * coefficients(); }  // floats of `sh` per Gaussian
  int64_t bytes() const;                                             // of the five arrays

  // Makes room for n Gaussians of the given degree; new values are uninitialised.
  void Resize(int64_t n, int degree);
};

// Array sizes agree with each other and the degree is 0–3. (kBadArgument otherwise; values are not looked at.)
Status Validate(const GaussianCloud& cloud);

// Axis-aligned box of the means of usable Gaussians (as far as HasUsableShape tells), from the origin on; nothing when
// there are none.
struct Bounds {
  std::array<float, 3> min;
  std::array<float, 3> max;
};
std::optional<Bounds> ComputeBounds(const GaussianCloud& cloud);

// The Gaussians at `rows`, in that order, repetition allowed; metadata is kept. Rows must be in range (kBadArgument).
Result<GaussianCloud> Subset(const GaussianCloud& cloud, std::span<const int64_t> rows);

// Appends `more` to `cloud`, whose origin stays. A lower SH degree on either side is raised by zero coefficients.
Status Append(GaussianCloud& cloud, const GaussianCloud& more);

// A copy with another SH degree: higher coefficients dropped, or zeros added.
GaussianCloud WithShDegree(const GaussianCloud& cloud, int degree);

// The one rule for what can be drawn; the rasterizer follows it, and everything that chooses, counts, measures or
// writes Gaussians asks it here (core/statistics.h has the same of views).
//
// Lengths beyond e to this are not drawn: the square, of which covariances are made, leaves the range of floats
// (½·ln of the largest is 44.36), in which the field's rasterizers calculate.
inline constexpr float kLargestLogScale = 44;
// Opacities below are not drawn: no eight-bit picture shows them.
inline constexpr float kLeastOpacity = 1.0f / 255;
// True when every stored value of row i is finite and no log-scale beyond kLargestLogScale, except that a log-scale may
// be −Inf (a flat Gaussian) and an opacity logit ±Inf (opacity 1 or 0): legal, and written by some tools. What it is
// false for is nowhere drawn, whatever its opacity (docs/formats.md).
bool IsUsable(const GaussianCloud& cloud, int64_t i);
// Whether any picture can show row i: usable, and of kLeastOpacity or more.
bool IsDrawn(const GaussianCloud& cloud, int64_t i);
// True when it is usable and every value is finite.
bool IsFinite(const GaussianCloud& cloud, int64_t i);

}  // namespace anchorsplat

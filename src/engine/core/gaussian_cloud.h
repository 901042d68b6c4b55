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

// The program's common splat representation: host memory, structure of arrays, in *stored* (pre-activation) space
// exactly as an INRIA PLY keeps it. Row i of every array belongs to Gaussian i. Plain data: call Validate() on input.
struct GaussianCloud {
  int sh_degree = 0;             // 0–3
  Buffer<float> means;           // [N,3] world, relative to `origin`
  Buffer<float> log_scales;      // [N,3] ln(world units), one per axis of the rotation
  Buffer<float> quats;           // [N,4] wxyz, any norm, not normalised
  Buffer<float> opacity_logits;  // [N] logit(opacity)
  Buffer<float> sh;              // [N,(sh_degree+1)²,3] coefficient-major, rgb fastest; [.,0,.] is f_dc

  std::optional<RenderMode> render_mode;  // as stated by the file; none if it states none
  std::vector<std::string> comments;      // of the file, except those for render mode and origin

  WorldOrigin origin = {0, 0, 0};  // world position = origin + mean
  bool double_means = false;       // write world coordinates as double in a PLY, as the input file did

  int64_t size() const { return static_cast<int64_t>(opacity_logits.size()); }
  bool empty() const { return opacity_logits.empty(); }
  int coefficients() const { return ShCoefficients(sh_degree); }
  int64_t sh_stride() const { return int64_t{3} * coefficients(); }  // floats of `sh` per Gaussian
  int64_t bytes() const;                                             // of the five arrays

  // Resizes all arrays to n Gaussians of the given degree; new values are uninitialised.
  void Resize(int64_t n, int degree);
};

// Checks that array sizes agree and the degree is 0–3, not the values. Error: kBadArgument.
Status Validate(const GaussianCloud& cloud);

// Axis-aligned box around the means of Gaussians with HasUsableShape, relative to the origin; none without such
// Gaussians.
struct Bounds {
  std::array<float, 3> min;
  std::array<float, 3> max;
};
std::optional<Bounds> ComputeBounds(const GaussianCloud& cloud);

// Copies the Gaussians at `rows`, in that order, repetition allowed; keeps metadata. kBadArgument: a row out of range.
Result<GaussianCloud> Subset(const GaussianCloud& cloud, std::span<const int64_t> rows);

// Appends `more`; `cloud` keeps its origin. The lower SH degree of the two is raised with zero coefficients.
Status Append(GaussianCloud& cloud, const GaussianCloud& more);

// A copy with another SH degree: higher coefficients are dropped, missing ones are zero.
GaussianCloud WithShDegree(const GaussianCloud& cloud, int degree);

// IsUsable and IsDrawn alone define what can be drawn: the rasterizer and all code that selects, counts, measures or
// writes Gaussians follow them (core/statistics.h has them for views).
//
// Gaussians with a larger log-scale are not drawn. Covariances need the square of the length, and it would overflow the
// floats of the field's rasterizers: ½·ln of the largest float is 44.36.
inline constexpr float kMaxLogScale = 44;
// Gaussians with a lower opacity are not drawn: no 8-bit picture shows them.
inline constexpr float kMinOpacity = 1.0f / 255;
// Whether every stored value of row i is finite and no log-scale exceeds kMaxLogScale. Two infinities are legal, as
// some tools write them: a log-scale of −Inf (a flat Gaussian) and an opacity logit of ±Inf (opacity 1 or 0). Unusable
// rows are never drawn, whatever their opacity (docs/formats.md).
bool IsUsable(const GaussianCloud& cloud, int64_t i);
// Whether a picture can show row i: usable, and opacity at least kMinOpacity.
bool IsDrawn(const GaussianCloud& cloud, int64_t i);
// Whether row i is usable and every value finite.
bool IsFinite(const GaussianCloud& cloud, int64_t i);

}  // namespace anchorsplat

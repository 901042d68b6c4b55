#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/cloud_blocks.h"
#include "core/cloud_view.h"

namespace anchorsplat {

// Quantile `q` (0–1) of `values`, interpolated linearly; NaN if empty. Reorders `values`.
float Quantile(std::span<float> values, double q);

// 1 %, 10 %, 50 %, 90 % and 99 % quantiles.
inline constexpr std::array<double, 5> kPercentiles = {0.01, 0.10, 0.50, 0.90, 0.99};
using Percentiles = std::array<float, kPercentiles.size()>;

// Upper bound of plausible coordinates and axis lengths, in world units. A file beyond it is damaged, of another kind,
// or in coordinates (of the Earth, say) too large for floats.
inline constexpr float kPlausibleExtent = 1e6f;

// IsUsable and IsDrawn of core/gaussian_cloud.h, for views.
bool IsUsable(const CloudView& cloud, int64_t i);
bool IsDrawn(const CloudView& cloud, int64_t i);
// Opacity at least kMinOpacity.
bool IsOpaqueEnough(float logit);

// IsUsable without looking at SH coefficients.
bool HasUsableShape(const CloudView& cloud, int64_t i);

// Ends the message "… Gaussians are not drawn: ".
inline constexpr std::string_view kWhyUnusable = "NaN, infinite or overflowing values";

// Number of unusable rows (!IsUsable). Without `harmonics`, rows with bad SH coefficients only are not counted: reading
// SH means reading most of a cloud's memory.
int64_t CountUnusable(const CloudView& cloud, bool harmonics = true);

// Health check of a cloud. Percentiles are over usable rows; those of axes only over rows with extent, those of
// axis_ratio only over rows with three non-zero axes. NaN if no row qualifies.
struct CloudStatistics {
  int64_t gaussians = 0;
  int sh_degree = 0;
  std::optional<Bounds> bounds;  // of usable means
  Percentiles largest_axis{};    // exp of the largest log-scale, world units
  Percentiles smallest_axis{};   // exp of the smallest
  Percentiles axis_ratio{};      // largest / smallest
  Percentiles opacity{};         // 0–1

  // Problems, in rows.
  int64_t not_finite = 0;                 // not usable: NaN, illegal Inf, or too long
  int64_t zero_quaternions = 0;           // all four components are zero
  int64_t unnormalised_quaternions = 0;   // norm off by more than 1 %: legal, but some programs expect 1
  int64_t zero_scales = 0;                // a log-scale of −Inf
  int64_t invisible = 0;                  // opacity below 1/255: no rasterizer draws them
  int64_t outliers = 0;                   // usable, but IsFarOut (core/framing.h)
  int64_t implausible = 0;                // mean or axis beyond kPlausibleExtent
  bool linear_looking_scales = false;     // stored scales look like lengths
  bool linear_looking_opacities = false;  // stored opacities look like 0–1
  int color_looking_harmonics = 0;        // 1 or 255: f_dc look like colours in 0–1 or 0–255; 0: neither
};
CloudStatistics ComputeStatistics(const CloudView& cloud);

// ComputeStatistics block by block, in two passes. Numbers are exact. Memory: at most 50 MB, plus 1 MB per thread in
// the first pass.
class StatisticsStudy final : public RowStudy {
 public:
  explicit StatisticsStudy(const CloudBlocks& blocks);
  ~StatisticsStudy() override;
  bool done() const override;
  void Visit(const CloudBlock& block) override;
  void EndPass() override;
  CloudStatistics Find() const;  // after the last pass

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace anchorsplat

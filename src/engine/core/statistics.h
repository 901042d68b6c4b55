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

// Value below which the fraction `q` (0–1) of `values` lies, linear between neighbours. NaN for no values. Reorders
// them.
float Quantile(std::span<float> values, double q);

// 1 %, 10 %, 50 %, 90 % and 99 % quantiles.
inline constexpr std::array<double, 5> kPercentiles = {0.01, 0.10, 0.50, 0.90, 0.99};
using Percentiles = std::array<float, kPercentiles.size()>;

// No splat of a real scene reaches farther, in world units, from zero, or has a Gaussian as long: a file that says so
// is damaged, of another kind, or in coordinates (of the Earth, say) that floats are too coarse for.
inline constexpr float kPlausibleExtent = 1e6f;

// IsUsable and IsDrawn of core/gaussian_cloud.h for the Gaussians of a view.
bool IsUsable(const CloudView& cloud, int64_t i);
bool IsDrawn(const CloudView& cloud, int64_t i);
// What opacity says to it: kLeastOpacity or more.
bool IsOpaqueEnough(float logit);

// IsUsable, as far as position, scales, rotation and opacity go.
bool HasUsableShape(const CloudView& cloud, int64_t i);

// Why rows are not usable, in a message: "… Gaussians are not drawn: " and this.
inline constexpr std::string_view kWhyUnusable = "NaN, infinite or overflowing values";

// Rows that nobody draws, whatever their opacity (not IsUsable). Without `harmonics` those whose SH alone is to blame
// are not counted: it is most of a cloud's memory.
int64_t CountUnusable(const CloudView& cloud, bool harmonics = true);

// What a person wants to know about a cloud before trusting it. Percentiles are over usable rows, those of the axes
// over rows that have any extent, of their ratio over those with three; NaN when there are none.
struct CloudStatistics {
  int64_t gaussians = 0;
  int sh_degree = 0;
  std::optional<Bounds> bounds;  // of the means of usable rows
  Percentiles largest_axis{};    // exp of the largest log-scale, world units
  Percentiles smallest_axis{};   // exp of the smallest
  Percentiles axis_ratio{};      // largest / smallest
  Percentiles opacity{};         // 0–1

  // Problems, as row counts.
  int64_t not_finite = 0;                 // not usable: NaN, Inf where it has no meaning, or too long
  int64_t zero_quaternions = 0;           // all four are zero: no rotation at all
  int64_t unnormalised_quaternions = 0;   // norm off by more than 1 %: legal, but some programs expect 1
  int64_t zero_scales = 0;                // a log-scale of −Inf
  int64_t invisible = 0;                  // opacity below 1/255: no rasterizer draws them
  int64_t outliers = 0;                   // usable, and more than ten times farther out than a picture shows: IsFarOut
  int64_t implausible = 0;                // a mean or an axis beyond kPlausibleExtent
  bool linear_looking_scales = false;     // stored scales look like lengths, not logarithms
  bool linear_looking_opacities = false;  // stored opacities look like 0–1, not logits
  int color_looking_harmonics = 0;        // f_dc look like colours from 0 to 1 or to 255; 0 where they do not
};
CloudStatistics ComputeStatistics(const CloudView& cloud);

// The same of a splat that is looked at block by block, twice.
// All numbers are exact. Memory: 50 MB at most and, the first time, 1 MB per thread.
class StatisticsStudy final : public RowStudy {
 public:
  explicit StatisticsStudy(const CloudBlocks& blocks);
  ~StatisticsStudy() override;
  bool done() const override;
  void Look(const CloudBlock& block) override;
  void EndPass() override;
  CloudStatistics Find() const;  // once it is done

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace anchorsplat

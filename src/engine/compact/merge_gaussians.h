#pragma once

#include <array>
#include <cstddef>

namespace anchorsplat {

// Merges two Gaussians into one and measures the error in the picture. Coordinates: a frame whose three axes are the
// view directions, in closer-view pixels, with the rasterizer's dilation for that view included.
//
// A Gaussian is invisible where its alpha is below 1/255. Copies are faint: at opacity 0.02 that is a fifth of the
// mass. So MergeGaussian has the mass and variance of the visible part only (VisibleVarianceShare). Merging Gaussians
// as stored would make dense splats too opaque, which costs 1 dB.
//
// Two Gaussians together have alpha α_a + α_b − α_a·α_b. The merged one has that function's mass, mean and covariance.
// Its opacity follows from its mass in the three views; if that exceeds the maximum opacity, it is widened instead. it
// becomes wider.
struct MergeGaussian {
  std::array<double, 3> mean{};
  std::array<double, 6> covariance{};  // xx xy xz yy yz zz, > 0
  double opacity = 0;                  // 0–1
  double thinnest = 0;                 // smallest variance of a Gaussian merged into it, without dilation

  // Derived by Measure().
  std::array<double, 3> area{};  // ∫ of the unit-opacity Gaussian per view, pixels²
  double mean_area = 0;          // approximate mean of the same over all directions
  double mass = 0;               // opacity · mean_area
};

// Variance of a Gaussian's visible part (alpha ≥ 1/255) relative to the whole: (1 − r + r·ln r) / (1 − r) with r =
// 1/(255·o). The visible part's mass is the fraction 1 − r.
double VisibleVarianceShare(double opacity);

// Maximum opacity of a merged Gaussian, of its visible part.
inline constexpr double kMostMergedOpacity = 1;

// Computes `area`, `mean_area` and `mass`.
void Measure(MergeGaussian& gaussian);

// ∫ g_a·g_b per view, which several functions need.
std::array<double, 3> Overlaps(const MergeGaussian& a, const MergeGaussian& b);

struct MergedPair {
  MergeGaussian gaussian;
  MergeGaussian sum;   // the same for α_a + α_b, with the mass of `gaussian`; costs refer to it
  double share = 0.5;  // weight of a's colour; b's is 1 − share
  bool valid = false;  // false: no finite Gaussian has these moments, or nothing would be visible
};
// `for_cost`: computes only `sum` and `share`, for speed.
MergedPair MergePair(const MergeGaussian& a, const MergeGaussian& b, const std::array<double, 3>& overlaps,
                     bool for_cost = false);

// Inner products of two colours: mean over all directions of their product, summed over red, green and blue.
struct MergeColors {
  double aa = 0, ab = 0, bb = 0;
};

// Cost of a merge: ∫ of the squared difference of colour × alpha over the picture, in pixels, averaged over the three
// views and over red, green and blue. The background is assumed as bright as the Gaussians ± kBehind: colour
// differences count fully, alpha differences with that weight.
inline constexpr double kBehind = 0.2;
double MergeCost(const MergeGaussian& a, const MergeGaussian& b, const std::array<double, 3>& overlaps,
                 const MergedPair& merged, const MergeColors& colors);

}  // namespace anchorsplat

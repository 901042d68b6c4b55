#pragma once

#include <array>
#include <cstddef>

namespace anchorsplat {

// Two Gaussians as one, and what that costs of the picture. All in a frame of three axes (the directions that they are
// looked at from) whose unit is a pixel of the closer view, with the rasterizer's dilation for that view added.
//
// What is seen of a Gaussian ends where it absorbs less than 1/255. Copies are faint: at an opacity of 0.02 that is a
// fifth of the mass. So here a Gaussian stands for what is seen of it: it has that one's mass and variance, see
// SeenVariance(). Merging those as they are stored makes a dense splat too opaque, and costs a decibel.
//
// Together, two Gaussians absorb α_a + α_b − α_a·α_b. The one that takes their place has that function's mass, mean and
// covariance. Its opacity says how much of it is seen in the three views; where that is more than a Gaussian can have,
// it becomes wider.
struct MergeGaussian {
  std::array<double, 3> mean{};
  std::array<double, 6> covariance{};  // xx xy xz yy yz zz, > 0
  double opacity = 0;                  // 0–1
  double thinnest = 0;                 // the least variance of a Gaussian in it, without dilation

  // What follows of these, see Measure().
  std::array<double, 3> area{};  // ∫ of the Gaussian itself per view, pixels
  double mean_area = 0;          // the same, mean over all directions, about
  double mass = 0;               // opacity times mean_area
};

// The variance of the part of a Gaussian where it absorbs 1/255 and more, as a share of its own. With r = 1/(255·o):
// (1 − r + r·ln r) / (1 − r); the part's mass is the share 1 − r.
double SeenVariance(double opacity);

// The most that a merged Gaussian absorbs, in terms of what is seen of it.
inline constexpr double kMostMergedOpacity = 1;

// Fills `area`, `mean_area` and `mass`.
void Measure(MergeGaussian& gaussian);

// What of the pair is needed more than once: ∫ g_a·g_b per view.
std::array<double, 3> Overlaps(const MergeGaussian& a, const MergeGaussian& b);

struct MergedPair {
  MergeGaussian gaussian;
  MergeGaussian sum;   // the same of α_a + α_b, with the mass of `gaussian`: what costs are taken from
  double share = 0.5;  // of a's colour; b's is the rest
  bool valid = false;  // false: there is no finite Gaussian with these moments, or nothing that could be seen
};
// `for_cost`: `gaussian` stays as it is, which is quicker.
MergedPair MergePair(const MergeGaussian& a, const MergeGaussian& b, const std::array<double, 3>& overlaps,
                     bool for_cost = false);

// Colours as inner products: the mean over all directions of products of the colours, summed over red, green and blue.
struct MergeColors {
  double aa = 0, ab = 0, bb = 0;
};

// How different the pair and the merged one look: ∫ of the squared difference of their colours times alpha over the
// picture, in pixels, mean over the three views and over red, green and blue. What stands behind them is taken for as
// bright as they are, give or take kBehind: the difference in colour counts in full, one of alpha that much.
inline constexpr double kBehind = 0.2;
double MergeCost(const MergeGaussian& a, const MergeGaussian& b, const std::array<double, 3>& overlaps,
                 const MergedPair& merged, const MergeColors& colors);

}  // namespace anchorsplat

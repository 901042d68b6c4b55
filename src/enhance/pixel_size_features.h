#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <utility>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/outline_profile.h"
#include "enhance/showing_gaussians.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// What a cloud's own outlines say about a pixel size d that is tried: the outline profile (outline_profile.h) of the
// cloud's alpha with the dilation of pixels of d, in units of d, seen from all sides; how it changes from pixels of
// d/√2 to those of d·√2; and how that change changes.
//
// A fit reproduces outlines as its training pixels saw them, where alpha rises over about one pixel. Rendered with the
// dilation of the pixels it was fitted with it shows them so; with smaller ones they are sharper, but by less than the
// pixel is smaller, as a fit cannot take back more than all of the dilation. In units of d the width thus falls while d
// grows, and says where d equals the pixel.
inline constexpr size_t kPixelSizeFeatures = 3 * kOutlineValues;
using PixelSizeFeatures = std::array<double, kPixelSizeFeatures>;  // natural logarithms

inline constexpr int64_t kLeastGaussians = 16;

// Standard fits have at least this much of PixelSizeProbe::showing(), most others less.
inline constexpr double kStandardShowing = 0.6;

// What is looked at. Alpha as the classic rasterizer and as the antialiased one draw it: they differ by what a fit of
// the other kind has given up of its width or of its opacity. And what would be seen over black, the background of most
// fits: Gaussians that are black themselves hide what is behind them and show nothing.
enum class Look { kAlpha, kAntialiased, kOverBlack };
inline constexpr size_t kLooks = 3;

// Sizes, opacities and number of the Gaussians that show: natural logarithms of the 10, 25, 50 and 75 % quantiles of
// the smallest, middle and largest axis in units of d, weighted by opacity × area; the quantiles of the opacity
// (not logarithms), and ln of the number of Gaussians.
inline constexpr size_t kSizeQuantiles = 4;
inline constexpr size_t kSizeFeatures = 4 * kSizeQuantiles + 1;
using SizeFeatures = std::array<double, kSizeFeatures>;

class PixelSizeProbe {
 public:
  // Only Gaussians near the middle of the cloud and small beside it are looked at, and at most 200,000 of them.
  // Outlines where the cloud was cut are left out, and those of Gaussians more than six times as coarse as the others
  // (√(largest × middle axis), median of those that show): a ground, walls, clutter around the object that no picture
  // shows. Fits of objects seen from all around have next to no outlines of such ones. kBadArgument: fewer than
  // kLeastGaussians of them have an opacity of 10 % or more and three positive scales.
  static Result<PixelSizeProbe> Make(const GaussianCloud& cloud);
  static Result<PixelSizeProbe> Make(TellingGaussians telling);

  // A first guess from the sizes of the Gaussians, within a factor of three or so; world units.
  double start() const { return start_; }

  // Share of the Gaussians that have an opacity of 10 % or more. Standard fits and those of AbsGS keep 0.6 to 0.99 of
  // theirs, as they take out the faint and lower all opacities from time to time. MCMC, random points and photographs
  // leave 0 to 0.68, few of them more than 0.6: what stands in no picture's way stays.
  double showing() const { return showing_; }

  // Share of the cloud's outlines, by their length in pictures of pixels of about `size` (of those that were made),
  // that are there because it was cut (cuts.h): by people, or here, where only the middle of a large cloud is looked
  // at. Those outlines count nowhere.
  double CutOutlines(double size, Look look = Look::kAlpha) const { return NearestTo(size, look).cut_outlines; }
  // The same of those that are only left out because coarse Gaussians made them.
  double CoarseOutlines(double size, Look look = Look::kAlpha) const { return NearestTo(size, look).coarse_outlines; }

  // The features of pixels of `size` (world units at the middle of the cloud). Pictures are made at half octaves from
  // start(), within six octaves, and only once; between them the logarithms are linear. Lengths scale with the cloud:
  // a cloud made c times as large has the same features at c times the size.
  Result<PixelSizeFeatures> At(double size, Look look = Look::kAlpha);

  // Of pixels of `size`.
  SizeFeatures SizesAt(double size) const;

 private:
  using OutlineValues = std::array<double, kOutlineValues>;
  struct Seen {
    OutlineValues values{};
    double cut_outlines = 0, coarse_outlines = 0;
  };
  PixelSizeProbe() = default;
  double StepOf(double size) const;
  Seen NearestTo(double size, Look look) const;
  Result<OutlineValues> AtStep(int step, Look look);
  Result<OutlineValues> ProfileAt(double size, Look look);

  GaussianCloud cloud_;
  CameraSet cameras_;
  double start_ = 0, distance_ = 0;
  double showing_ = 1;
  bool left_out_ = false;  // the second channel of cloud_ is 1 where a Gaussian was cut, the third where it is coarse
  double farthest_pixel_ = 0;  // world size of a picture's pixel where the whole cloud is in it; none is larger
  Rasterizer rasterizer_;
  RenderOutput output_;
  SizeFeatures sizes_{};  // with d = 1
  std::map<std::pair<Look, int>, Seen> known_;
};

}  // namespace anchorsplat

#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/render_mode.h"
#include "enhance/showing_gaussians.h"

namespace anchorsplat {

// How a splat that does not say so was trained, by its thinnest Gaussians.
//
// A classic rasterizer draws a Gaussian of any size as wide as a pixel, so fits let some shrink to nothing: sizes have
// a long tail. An antialiased one makes a Gaussian that is thinner than a pixel along two axes fainter, by the product
// of both, until it is gone: middle axes end somewhat below the pixel, and the thinnest Gaussians are as opaque as can
// be. Where a width has been added to all axes, by Mip-Splatting's 3-D filter or by enhancing, the smallest axes end at
// that width. What a network has enhanced has its Gaussians in twins. Opacities that were raised since, or set
// to one, make everything wider than it was trained: little of the width that was lost is missing then.
enum class TrainedKind {
  kClassic,
  kAntialiased,
  kWidened,   // Mip-Splatting, or filtered: has all its width
  kEnhanced,  // by a network (enhance/enhanced_look.h): likewise
  kRaised,    // somebody has raised the opacities of what was trained
  kUnclear,   // between these: like a splat that another program has changed
};

// The words of `info` and of reports.
std::string_view NameOf(TrainedKind kind);

// How long the tail of an axis is: the mean of max(0, ln(q / x)) over the share of the Gaussians below the quantile q;
// the geometric mean of that of the 2 % and that of the 5 % quantile. 0: they all end there. Does not depend on the
// unit, and hardly on formats that keep logarithms in steps. Where a format has cut the tail off (all below e^−10 of
// SPZ become that), it is that of the 5 % quantile, or of 1.3 times the share that was cut.
struct SizeTails {
  int64_t gaussians = 0;  // that show (ShowingGaussians::all) and have three positive axes
  double middle = 0;      // of the middle axis
  double smallest = 0;    // of the smallest one
  double roundness = 0;   // the 5 % quantile of the smallest axis over that of the middle one
  double opaque = 0;      // the share of opacities above 0.95 among the tenth of least middle × largest axis
  double faint = 0;       // the share of opacities below 0.3 among all that show
  double cut_off = 0;     // the share of the smallest axes that a format cut off
  // Opacities were raised: hardly one is faint, and they do not begin all at once either, as where somebody has thrown
  // the faint ones away.
  bool raised = false;

  // The smallest axes as those of widened splats, nearly.
  bool rather_round() const { return roundness > 0.3; }
};
SizeTails SizeTailsOf(const GaussianCloud& showing);  // of ShowingGaussians::all

// By sizes alone, so never kEnhanced. Nothing: fewer than 400 Gaussians, too few to tell; below 1000 there is more that
// is unclear.
std::optional<TrainedKind> Judge(const SizeTails& tails);

// Where the harmonics are of what shows.
struct WholeCloud {
  std::span<const int64_t> rows;  // ShowingGaussians::rows_of_all
  // The cloud; called only where they decide. No function, or a cloud of degree 0: they are not known.
  std::function<CloudView()> harmonics;
};

// By sizes and by what networks leave. Of ShowingGaussians::all: looks at the Gaussians only, not at what the cloud
// says of itself.
std::optional<TrainedKind> TrainedKindOf(const GaussianCloud& showing, const WholeCloud& whole = {});
// The same, with the harmonics of the cloud that these are of.
std::optional<TrainedKind> TrainedKindOf(const CloudView& cloud, const ShowingGaussians& showing);

// What of that counts beside a tag. Trainers that know no other mode tag everything classic, and formats that have no
// word for Mip-Splatting or for what has been enhanced tag it antialiased: where the Gaussians have a width all the
// same, they are believed, and where opacities were raised. Classic fits of few, large Gaussians look so, too, and a
// `mip` tag says it itself: nothing. `showing`: how many Gaussians it was seen of.
std::optional<TrainedKind> BesideTag(std::optional<TrainedKind> kind, std::optional<RenderMode> tag, int64_t showing);

// Has all its width.
inline bool IsWide(std::optional<TrainedKind> kind) {
  return kind == TrainedKind::kWidened || kind == TrainedKind::kEnhanced;
}

}  // namespace anchorsplat

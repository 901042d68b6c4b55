#include "enhance/pixel_size_guard.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/parallel.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/lost_width.h"
#include "enhance/pixel_size_features.h"
#include "enhance/showing_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int64_t kNeighbours = 8;
constexpr int64_t kGuardRowsPerTask = 16384;
constexpr int64_t kGuardSamples = 256;  // of the spacing; its median is good to a few percent

// Gaussians on a pixel of the surface × Gaussians. In fits of known pixels with 2,700 to 28,000 visible Gaussians there
// are 0.1 to 1.3 on a pixel, most where thin things were seen in few, and 2.0 in one of 82,000 from random points; many
// Gaussians come of many pixels, on which they stand sparsely. An estimate that is k times too large says k² times as
// many. Where most Gaussians show, fits of known pixels have half as many at most (0.48 times the bound, of 100 fits):
// what is dense there is a capture that others have thinned out.
constexpr double kCrowded = 48'000, kCrowdedShowing = 25'000;
constexpr double kFaintShowing = 0.45, kMostlyShowing = 0.6;  // shares that show, between which the bound changes
constexpr double kMostCrowded = 2.5, kNeverCrowded = 0.35;
// How many Gaussians there were before it was cut is not known: parts of captures are at 0.57 and more, of fits of
// small pictures at 0.15 to 0.6. Cut is what has this share of its outlines at cuts; of 49 fits that nobody cut none
// has any.
constexpr double kCrowdedPart = 0.55, kPart = 0.1;
// Where a splat was cut, insides that no picture showed become outlines. Pixels of parts are taken smaller by this
// times the share of the outlines that do not count; ln.
constexpr double kPartCaution = 0.3;
// Where hardly an outline is left that is not a cut's, the rest says nothing.
constexpr double kNothingButCuts = 0.9;
// 90 % over 10 % quantile of the spacings: two things of different size, fitted to pixels of different size. 5.6 at
// most in 58 fits and three captures, but 13 in a dense one of random points, most of which do not show; 6.3 where an
// object lies beside another that is twice as large, 9.4 and 25 where it is three and eight times as large.
constexpr double kUneven = 7;
// √(largest × middle axis) of the smallest tenth lies between 0.3 and 2.3 pixels in the 152 fits of the regression, and
// at 0.2 in one of a chair whose slats are thinner than a pixel.
constexpr double kSmallestAxis = 0.12;  // pixels; with a margin
// Black Gaussians may move the estimate this much before it counts as theirs.
constexpr double kMoved = 1.5;
// The filter's variance at the usual four times closer is 0.2 pixels²: with a pixel of this many widths it lengthens
// the middle axis of three in four Gaussians by less than a twentieth.
constexpr double kHarmless = 0.7;
// A crowd hardly above the bound says little: pixels shrink with this power of how far above it is, down to harmless
// ones. Dense fits of small pictures are at up to 1.3 times the bound, captures from 1.7 times on.
constexpr double kCrowdedFall = 4;
// The regressions have learned from fits of 4,000 Gaussians and more. Outlines of few Gaussians are as soft as those
// are far apart: fits of 1,000 and 380 look like pixels 1.6 and 2.7 times too large, one of 2,500 like 1.1
// (table_football).
constexpr int64_t kEnough = 2500;

struct Spacing {
  double median = 0;  // 0: too few
  double unevenness = 1;
};

// Of the squares that Gaussians have for themselves, where they lie on surfaces: kNeighbours others lie within π r².
Spacing SpacingOf(const GaussianCloud& cloud) {
  const int64_t count = cloud.size();
  if (count <= kNeighbours) return {};
  const Buffer<float>& positions = cloud.means;
  const int64_t samples = std::min(kGuardSamples, count);
  Buffer<float> farthest(static_cast<size_t>(samples));
  ParallelFor(0, samples, 8, [&](int64_t first, int64_t last) {
    for (int64_t s = first; s < last; ++s) {
      const float* at = positions.data() + 3 * (s * count / samples);
      std::array<double, kNeighbours + 1> nearest;  // itself is one of them; sorted
      nearest.fill(std::numeric_limits<double>::infinity());
      for (int64_t k = 0; k < count; ++k) {
        const double distance = SquaredDistance(positions.data() + 3 * k, at);
        if (distance >= nearest.back()) continue;
        auto place = std::upper_bound(nearest.begin(), nearest.end(), distance);
        std::move_backward(place, nearest.end() - 1, nearest.end());
        *place = distance;
      }
      farthest[static_cast<size_t>(s)] = static_cast<float>(std::sqrt(nearest.back()));
    }
  });
  const double side = std::sqrt(std::numbers::pi / static_cast<double>(kNeighbours));
  const auto dense = double{Quantile(farthest, 0.1)}, sparse = double{Quantile(farthest, 0.9)};
  return {double{Quantile(farthest, 0.5)} * side, dense > 0 ? sparse / dense : 1};
}

double MiddleAxis(const GaussianCloud& cloud, size_t i) {
  std::array<float, 3> axes;
  std::copy_n(cloud.log_scales.data() + 3 * i, 3, axes.begin());
  std::ranges::sort(axes);
  return std::exp(double{axes[1]});
}

std::string Number(double value) { return Fixed(value, value < 10 ? 1 : 0); }

// `probe`: of showing.telling. What is left of that is used up.
Result<PixelSizeEvidence> Gather(ShowingGaussians& showing, int64_t all, const Result<PixelSizeProbe>& probe,
                                 std::optional<RenderMode> mode) {
  PixelSizeEvidence evidence;
  evidence.gaussians = showing.bright.size();
  evidence.all = all;
  if (evidence.gaussians < kLeastGaussians) {
    return Error{ErrorCode::kBadArgument,
                 Cat("fewer than ", kLeastGaussians,
                     " Gaussians that show and are small beside the splat, to estimate a pixel size from")};
  }
  const Spacing spacing = SpacingOf(showing.bright);
  evidence.spacing = spacing.median;
  evidence.unevenness = spacing.unevenness;
  if (!probe.ok()) return probe.error();
  evidence.small_axis = probe->start();
  LeaveIfAbandoned();
  Buffer<float> middle;
  for (size_t i = 0; i < showing.bright.opacity_logits.size(); ++i) {
    middle.push_back(static_cast<float>(MiddleAxis(showing.bright, i)));
  }
  evidence.width = double{Quantile(middle, 0.25)};
  if (showing.telling_not_black) {
    Result<PixelSizeProbe> without = PixelSizeProbe::Make(std::move(*showing.telling_not_black));
    if (without.ok()) {
      const auto estimate = EstimatePixelSize(*without, mode);
      if (estimate.ok()) evidence.without_black = estimate->size;
    }
  }
  return evidence;
}

}  // namespace

double MostGaussiansPerPixel(int64_t gaussians, double showing) {
  const double share = std::clamp((showing - kFaintShowing) / (kMostlyShowing - kFaintShowing), 0.0, 1.0);
  const double crowded = std::lerp(kCrowded, kCrowdedShowing, share);
  return std::clamp(crowded / static_cast<double>(std::max<int64_t>(1, gaussians)), kNeverCrowded, kMostCrowded);
}

Result<PixelSizeEvidence> GatherPixelSizeEvidence(const GaussianCloud& cloud) {
  ShowingGaussians showing = FindShowingGaussians(cloud);
  const int64_t all = showing.telling.cloud.size();
  const Result<PixelSizeProbe> probe = PixelSizeProbe::Make(std::move(showing.telling));
  return Gather(showing, all, probe, cloud.render_mode);
}

Buffer<float> CautiousPixelSizes(const GaussianCloud& cloud, const PixelSizeFinding& finding) {
  Buffer<float> sizes(static_cast<size_t>(cloud.size()));
  const double none = 1e-15 * finding.size;  // a pixel has some size
  ParallelFor(0, cloud.size(), kGuardRowsPerTask, [&](int64_t first, int64_t last) {
    for (auto i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i) {
      sizes[i] =
          static_cast<float>(std::clamp(kHarmless * MiddleAxis(cloud, i), std::max(none, finding.least), finding.size));
    }
  });
  return sizes;
}

PixelSizeFinding Judge(const PixelSizeEstimate& estimate, const PixelSizeEvidence& evidence) {
  PixelSizeFinding finding;
  finding.size = estimate.size;
  finding.largest = std::max(estimate.size, evidence.without_black);
  finding.estimate = estimate;
  finding.part = estimate.cut_outlines > kPart;
  const double of_whole = MostGaussiansPerPixel(evidence.gaussians, estimate.showing);
  const double most = finding.part ? std::min(of_whole, kCrowdedPart) : of_whole;
  const auto crowd_at = [&](double size) { return evidence.spacing > 0 ? std::pow(size / evidence.spacing, 2) : 0; };
  const double crowd = crowd_at(estimate.size);
  if (crowd > most) {
    finding.contradictions.push_back(
        most < of_whole
            ? Cat("there would be ", Fixed(crowd, 2),
                  " Gaussians on every pixel of the surface, and parts that were cut out of fits have at most ", most)
            : Cat("there would be ", Number(crowd), " Gaussians on every pixel of the surface, and fits of ",
                  WithThousands(evidence.gaussians), evidence.gaussians >= int64_t{kMostShowing} ? " and more" : "",
                  " keep at most ", Number(most)));
  }
  if (estimate.cut_outlines > kNothingButCuts) {
    finding.contradictions.push_back(
        Cat(Fixed(100 * estimate.cut_outlines, 0),
            " % of its outlines look as if a part had been cut off there, and say nothing about pixels"));
  }
  if (evidence.unevenness > kUneven && estimate.showing >= kFaintShowing) {
    finding.contradictions.push_back(Cat("a tenth of its Gaussians lie ", Fixed(evidence.unevenness, 0),
                                         " times as far apart as another tenth, and those of one fit up to ",
                                         Fixed(kUneven, 0), " times: they have no one pixel"));
  }
  if (evidence.small_axis < kSmallestAxis * estimate.size) {
    finding.contradictions.push_back(Cat("its small Gaussians measure ", Fixed(evidence.small_axis / estimate.size, 2),
                                         " of such a pixel, and those of fits 0.2 to 2.3"));
  }
  if (evidence.without_black > 0 && estimate.size > kMoved * evidence.without_black) {
    finding.contradictions.push_back(
        Cat("without its black Gaussians, which no picture shows, the outlines say ", evidence.without_black));
  }
  if (finding.part) finding.size *= std::exp(-kPartCaution * estimate.cut_outlines);
  finding.least = finding.size;
  if (finding.contradicted()) {
    double least = 0;
    const bool crowd_alone = crowd > most && finding.contradictions.size() == 1;
    if (crowd_alone) least = estimate.size * std::pow(most / crowd, kCrowdedFall);
    // Without its black Gaussians the outlines say a size, too; it counts where nothing contradicts that one.
    const double without = evidence.without_black;
    if (without > 0 && crowd_at(without) <= most && evidence.small_axis >= kSmallestAxis * without) {
      least = std::max(least, without);
    }
    finding.size = std::min(finding.size, std::max(least, kHarmless * evidence.width));
    finding.least = std::min(least, finding.size);
  }
  if (evidence.all > 0 && evidence.all < kEnough) {
    const double apart = std::sqrt(static_cast<double>(evidence.all) / static_cast<double>(kEnough));
    finding.size = std::min(finding.size, estimate.size * apart);
    finding.least = std::min(finding.least, finding.size);
    if (evidence.all < kFewGaussians) {
      finding.contradictions.push_back(
          Cat("it has ", WithThousands(evidence.all), " Gaussians, and outlines of so few are soft at any pixel"));
    }
  }
  return finding;
}

Result<PixelSizeFinding> FindPixelSize(const GaussianCloud& cloud) {
  return FindPixelSize(FindShowingGaussians(cloud), cloud.render_mode);
}

Result<PixelSizeFinding> FindPixelSize(ShowingGaussians showing, std::optional<RenderMode> mode) {
  const int64_t all = showing.telling.cloud.size();
  Result<PixelSizeProbe> probe = PixelSizeProbe::Make(std::move(showing.telling));
  if (!probe.ok()) return probe.error();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelSizeEstimate estimate, EstimatePixelSize(*probe, mode));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelSizeEvidence evidence, Gather(showing, all, probe, mode));
  return Judge(estimate, evidence);
}

}  // namespace anchorsplat

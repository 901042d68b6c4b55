#include "enhance/pixel_size_guard.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "core/kd_tree.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/cloud_shape.h"
#include "enhance/gaussian_regions.h"
#include "enhance/lost_width.h"
#include "enhance/pixel_size_features.h"
#include "enhance/showing_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int64_t kLeastForSpacing = 8;
constexpr int64_t kGuardRowsPerTask = 16384;
constexpr int64_t kGuardSamples = 256;  // of the spacing; its median is good to a few percent

// Gaussians on a pixel of the surface × Gaussians. In fits of known pixels with 2,700 to 28,000 visible Gaussians there
// are 0.1 to 1.3 on a pixel, most where thin things were seen in few, and 2.0 in one of 82,000 from random points; many
// Gaussians come of many pixels, on which they stand sparsely. An estimate that is k times too large says k² times as
// many. Where most Gaussians show, fits of known pixels have half as many at most (0.48 times the bound, of 100 fits):
// what is dense there is a capture that others have thinned out. Where fewer than half do, dense fits from random
// points have up to twice the bound (69,000 of them at 200²: 2.4).
constexpr double kCrowded = 80'000, kCrowdedShowing = 25'000;
constexpr double kFaintShowing = 0.45, kMostlyShowing = 0.6;  // shares that show, between which the bound changes
constexpr double kMostCrowded = 2.5, kNeverCrowded = 0.35;
// How many Gaussians there were before it was cut is not known: parts of captures are at 0.57 and more, of fits of
// small pictures at 0.15 to 0.6. Cut is what has this share of its outlines at cuts; of 49 fits that nobody cut none
// has any. Even ends that are none, the feet of a chair after few steps, have 0.16 to 0.19 and 0.7 to 0.95 Gaussians on
// a pixel, so the bound for a part counts in full only where it is largely cut.
constexpr double kCrowdedPart = 0.55, kPart = 0.1, kLargelyCut = 0.3;
// Where a splat was cut, insides that no picture showed become outlines. Pixels of parts are taken smaller by this
// times the share of the outlines that do not count; ln.
constexpr double kPartCaution = 0.3;
// Where hardly an outline is left that is not a cut's or of coarse Gaussians, the rest says nothing.
constexpr double kNothingButCuts = 0.9;
// 90 % over 10 % quantile of the spacings of 512: two things of different size, or a subject and what is far behind it,
// fitted to pixels of different size. At most 2.6 in 101 fits and in captures, but 2.7 and 2.8 in a plant and a
// chair; 2.5 to 2.9 where an object lies beside one like it that is twice as large, from 2.9 on beside one three times
// as large, on a ground or before a sky. Of a subject with less than a tenth of the Gaussians it says nothing. From the
// first on pixels shrink with this power of it, and from the second on it contradicts.
constexpr double kUneven = 2.7, kMostUneven = 2.85, kUnevenFall = 4;
// A splat has few Gaussians where it has little detail, and these are hardly larger than elsewhere: 0.2 to 1.4 times in
// 35 of 37 fits, 1.8 and 2.2 in two (`growth` of `bench pixel-size --json`). Those of larger pixels are larger.
constexpr double kGrown = 1.6;
// Of an uneven splat no more is taken than this times the spacing of its densest tenth.
constexpr double kOfDense = 1 / 0.85;
// Spacing of 512, over its median, below which Gaussians come of smaller pixels than the others. The densest place of
// 22 fits is at 0.52 and more, of captures at 0.37.
constexpr double kCloser = 0.45;
// √(largest × middle axis) of the smallest tenth, in pixels of the estimate: 0.39 and more in 360 of 364 fits, 0.36 in
// a broom (taken for 0.72 of its pixel), and 0.23, 0.07 and 0.02 where the estimates are 3.7, 11 and 23 times the truth
// (`start` and `estimate` of data/pixel-size-kinds.json.gz). Hair and grass, whose blades are thinner than a pixel and
// which have no outlines: 0.13 and 0.32 at 4.3 and 2.6 times. Below the first pixels shrink with this power, and below
// the second it contradicts.
constexpr double kSmallAxis = 0.4, kSmallestAxis = 0.3, kSmallFall = 4;
// That and how far the densest tenth lies apart, their geometric mean in pixels of the estimate: 0.49 and more in 177
// fits, 0.34 where hills seen from above are taken for pixels seven times as large.
constexpr double kSmallAndDense = 0.42;
// Where the densest tenth lies further apart, the estimate is too small if anything: 0.5 to 2.7 in 60 fits and 0.5 to
// 1.1 in captures; 4.8, 6.9 and 7.7 in bushes whose leaves are taken for 0.25, 0.16 and 0.12 of their pixels. Of true
// pixels it is 0.52 to 3.2.
constexpr double kTooSparse = 4.5, kDensest = 0.45;
constexpr double kFarFromAll = 1.5;  // of what outlines say at most
// A room around an object has outlines of its own, most of them of coarse Gaussians; of such antialiased fits three are
// taken for 2.0, 2.1 and 4.2 of their pixels. Objects alone have 0.02 of such outlines at most, and strangeness 0.3 to
// 0.92.
constexpr double kCoarseOfRoom = 0.05, kStrangeOfRoom = 0.95;
// Black Gaussians may move the estimate this much before it counts as theirs.
constexpr double kMoved = 1.5;
// An interval that is wider from end to end says nothing.
constexpr double kNoEstimate = 10;
constexpr double kSomeSize = 1e-12;  // of an estimate: a pixel has some size
// Land seen from above is flat (thickness over width; 0.14 for blocks of houses, 0.26 and more for 40 objects), and has
// a rim and a lower side that no picture shows: their outlines are as soft as its Gaussians are large, at pixels two to
// five times smaller. They are strange (0.9 and more; standard fits 0.4 to 0.8), or the two regressions disagree.
// Where Gaussians lie further apart than two such pixels (land: 0.4 to 1.2), those are not too large.
constexpr double kStrangeOfFlat = 0.85, kDisagreeingOfFlat = 0.87, kSparse = 2;
// An aircraft is as flat, but fills 0.35 to 0.7 of the rectangle around it where land, facades and carpets fill 0.85
// and more; and its small Gaussians (√(largest × middle axis)) measure 0.54 to 0.95 of the estimate, those of land 0.32
// to 0.58. What is like aircraft in both is none of land.
constexpr double kFills = 0.7, kSmallOfFlat = 0.5;
// Gaussians that may only be balls are as large as they lie apart and no pixel made them so: two fits were taken
// for 1.7 of theirs. Other fits are at 0 to 0.66, Gaussians that were made from the points of a mesh at 0.62 and 1.
constexpr double kBalls = 0.9;
// Beyond, the two regressions are about something that neither has seen: pictures of parts of an object, whose outlines
// hardly any of them shows. Of 76 fits like standard ones three are below: a palm, a broom, trousers.
constexpr double kRegressionsDisagree = 0.67;
// Antialiased splats look like 0.44 to 0.86 of their pixels, classic ones of known pixels like 0.73 and more, but small
// ones and those of few steps like 0.59. Cameras of pixels twice as large are found out unless the estimate is 1.16
// times the truth.
constexpr double kSharperThanClassic = 0.58;
// Regions that a cloud is looked at in, and how many of them a Gaussian belongs to.
constexpr int64_t kRegions = 8192;
constexpr size_t kRegionsAround = 2;
// A crowd hardly above the bound says little: pixels shrink with this power of how far above it is, down to harmless
// ones. Dense fits of small pictures are at up to 1.3 times the bound, captures from 1.7 times on.
constexpr double kCrowdedFall = 4;
// The regressions have learned from fits of 4,000 Gaussians and more. Outlines of few Gaussians are as soft as those
// are far apart: fits of 1,500 look like pixels 1.4 to 2.3 times too large, of 400 like 2.7 to 5.
constexpr int64_t kEnough = 4000;
constexpr double kFewPower = 0.75;
// Spacing of fits that were kept to 800 to 3,500 Gaussians, in pixels of the estimate: 1.5 to 2.2 (eight), and 0.7 to
// 1.7 where there were enough.
constexpr double kClose = 1.3;

struct Surface {
  double spacing = 0;  // 0: too few
  double footprint = 0;
  double of_many = 0, dense = 0, closest = 0, unevenness = 1, growth = 1;
  double harmless = 0;
};

// Geometric mean of the `values` of the tenth of places with the largest `key`, over that of the tenth with the least.
double Growth(const Buffer<float>& key, const Buffer<float>& values) {
  std::vector<size_t> order(key.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, {}, [&](size_t k) { return std::pair(key[k], k); });
  const size_t tenth = std::max<size_t>(1, order.size() / 10);
  double sum = 0;
  for (size_t k = 0; k < tenth; ++k) {
    const float least = values[order[k]], most = values[order[order.size() - 1 - k]];
    if (!(least > 0 && most > 0)) return std::numeric_limits<double>::infinity();
    sum += std::log(double{most}) - std::log(double{least});
  }
  return std::exp(sum / static_cast<double>(tenth));
}

// Of places that stand for all. What is harmless is so in nine of ten regions, as a few are anything.
Surface SurfaceOf(const GaussianCloud& cloud) {
  const int64_t count = cloud.size();
  if (count <= kLeastForSpacing) return {};
  const GaussianRegions regions(cloud);
  const int64_t samples = std::min(kGuardSamples, count);
  Buffer<float> spacing(static_cast<size_t>(samples)), footprint = spacing, of_many = spacing, harmless = spacing;
  ParallelFor(0, samples, 8, [&](int64_t first, int64_t last) {
    for (int64_t s = first; s < last; ++s) {
      const float* place = cloud.means.data() + 3 * (s * count / samples);
      const GaussianRegion region = regions.Around(place);
      const auto at = static_cast<size_t>(s);
      spacing[at] = static_cast<float>(region.spacing);
      footprint[at] = static_cast<float>(region.footprint);
      of_many[at] = static_cast<float>(regions.SpacingOfMany(place));
      harmless[at] = static_cast<float>(region.HarmlessPixel());
    }
  });
  const double growth = Growth(of_many, footprint);  // before Quantile puts them in another order
  const auto dense = double{Quantile(of_many, 0.1)}, sparse = double{Quantile(of_many, 0.9)};
  return {.spacing = double{Quantile(spacing, 0.5)},
          .footprint = double{Quantile(footprint, 0.5)},
          .of_many = double{Quantile(of_many, 0.5)},
          .dense = dense,
          .closest = double{Quantile(of_many, 0.0)},
          .unevenness = dense > 0 ? sparse / dense : std::numeric_limits<double>::infinity(),
          .growth = growth,
          .harmless = double{Quantile(harmless, 0.9)}};
}

// Of those rows, nothing but where they are and how large.
GaussianCloud PlacesAndScales(const GaussianCloud& cloud, const std::vector<int64_t>& rows) {
  GaussianCloud out;
  out.Resize(std::ssize(rows), 0);
  for (size_t k = 0; k < rows.size(); ++k) {
    std::copy_n(cloud.means.data() + 3 * rows[k], 3, out.means.data() + 3 * k);
    std::copy_n(cloud.log_scales.data() + 3 * rows[k], 3, out.log_scales.data() + 3 * k);
  }
  return out;
}

std::string Number(double value) { return Fixed(value, value < 10 ? 1 : 0); }

// `probe`: of showing.telling. What is left of that is used up.
Result<PixelSizeEvidence> Gather(ShowingGaussians& showing, int64_t all, const Result<PixelSizeProbe>& probe,
                                 std::optional<RenderMode> mode) {
  PixelSizeEvidence evidence = EvidenceOfSurface(showing.bright);
  evidence.all = all;
  if (evidence.gaussians < kLeastGaussians) {
    return Error{ErrorCode::kBadArgument,
                 Cat("fewer than ", kLeastGaussians,
                     " Gaussians that show and are small beside the splat, to estimate a pixel size from")};
  }
  if (!probe.ok()) return probe.error();
  evidence.small_axis = probe->start();
  LeaveIfAbandoned();
  if (showing.telling_not_black) {
    Result<PixelSizeProbe> without = PixelSizeProbe::Make(std::move(*showing.telling_not_black));
    if (without.ok()) {
      const auto estimate = EstimatePixelSize(*without, mode);
      if (estimate.ok()) {
        evidence.without_black = estimate->size;
        evidence.softness_without_black = estimate->softness;
      }
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

PixelSizeEvidence EvidenceOfSurface(const GaussianCloud& bright) {
  PixelSizeEvidence evidence;
  evidence.gaussians = bright.size();
  if (evidence.gaussians < kLeastGaussians) return evidence;
  const Surface surface = SurfaceOf(bright);
  evidence.spacing = surface.spacing;
  evidence.footprint = surface.footprint;
  evidence.of_many = surface.of_many;
  evidence.dense = surface.dense;
  evidence.closest = surface.closest;
  evidence.unevenness = surface.unevenness;
  evidence.growth = surface.growth;
  evidence.harmless = surface.harmless;
  const CloudShape shape = ShapeOf(bright);
  evidence.flatness = shape.flatness;
  evidence.fill = shape.fill;
  evidence.roundness = shape.roundness;
  if (shape.is_flat()) evidence.sides = TwoSidesOf(bright);
  return evidence;
}

Result<PixelSizeEvidence> GatherPixelSizeEvidence(const GaussianCloud& cloud) {
  ShowingGaussians showing = FindShowingGaussians(cloud);
  const int64_t all = showing.telling.cloud.size();
  const Result<PixelSizeProbe> probe = PixelSizeProbe::Make(std::move(showing.telling));
  return Gather(showing, all, probe, cloud.render_mode);
}

Buffer<float> CautiousPixelSizes(const GaussianCloud& cloud, const PixelSizeFinding& finding) {
  // An even sample of those that show, wherever they are.
  std::vector<int64_t> showing;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (HasUsableShape(cloud, i) && ShowsInPictures(cloud, static_cast<size_t>(i))) showing.push_back(i);
  }
  const auto every = [&](int64_t most) {
    const int64_t count = std::ssize(showing), kept = std::min(count, most);
    std::vector<int64_t> rows(static_cast<size_t>(kept));
    for (int64_t k = 0; k < kept; ++k) rows[static_cast<size_t>(k)] = showing[static_cast<size_t>(k * count / kept)];
    return rows;
  };
  Buffer<float> sizes(static_cast<size_t>(cloud.size()));
  const bool believed = finding.least >= finding.size;
  const double none = std::max(kSomeSize * finding.size, believed ? 0 : finding.least);  // a pixel has some size
  std::ranges::fill(sizes, static_cast<float>(none));
  if (showing.empty()) return sizes;

  const std::vector<int64_t> sample = every(int64_t{kMostShowing}), places = every(kRegions);
  const auto thinned = static_cast<double>(showing.size()) / static_cast<double>(sample.size());
  const GaussianRegions regions(PlacesAndScales(cloud, sample), thinned);
  Buffer<float> harmless(places.size());
  ParallelFor(0, std::ssize(places), 8, [&](int64_t first, int64_t last) {
    for (auto k = static_cast<size_t>(first); k < static_cast<size_t>(last); ++k) {
      const float* place = cloud.means.data() + 3 * places[k];
      const bool safe = believed && regions.SpacingOfMany(place) >= finding.closer;
      harmless[k] = static_cast<float>(safe ? finding.size : regions.Around(place).HarmlessPixel());
    }
  });
  LeaveIfAbandoned();
  // The least of the regions around, as the edge of a fine one is near a coarse one, too.
  const KdTree nearest_place(PlacesAndScales(cloud, places).means);
  ParallelFor(0, cloud.size(), kGuardRowsPerTask, [&](int64_t first, int64_t last) {
    std::array<KdTree::Neighbour, kRegionsAround> around;
    for (auto i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i) {
      if (!HasUsableShape(cloud, static_cast<int64_t>(i))) continue;
      const float* p = cloud.means.data() + 3 * i;
      const int64_t found = nearest_place.NearestTo({p[0], p[1], p[2]}, around);
      double least = finding.size;
      for (const auto& place : std::span(around).first(static_cast<size_t>(found))) {
        least = std::min(least, double{harmless[static_cast<size_t>(place.index)]});
      }
      sizes[i] = static_cast<float>(std::clamp(least, none, finding.size));
    }
  });
  return sizes;
}

PixelSizeFinding Judge(const PixelSizeEstimate& estimate, const PixelSizeEvidence& evidence) {
  PixelSizeFinding finding;
  finding.size = estimate.size;
  finding.largest = std::max(estimate.size, evidence.without_black);
  finding.estimate = estimate;
  finding.small_axis = evidence.small_axis;
  finding.dense = evidence.dense;
  finding.part = estimate.cut_outlines > kPart;
  const double of_whole = MostGaussiansPerPixel(evidence.gaussians, estimate.showing);
  const double cut = std::clamp((estimate.cut_outlines - kPart) / (kLargelyCut - kPart), 0.0, 1.0);
  const double most = std::min(of_whole, of_whole * std::pow(kCrowdedPart / of_whole, cut));
  // Those in layers above each other do not make detail.
  const double apart = std::max(evidence.spacing, evidence.footprint);
  const auto crowd_at = [&](double size) { return apart > 0 ? std::pow(size / apart, 2) : 0; };
  const double crowd = crowd_at(estimate.size);
  if (crowd > most) {
    finding.contradictions.push_back(
        most < of_whole
            ? Cat("there would be ", Fixed(crowd, 2),
                  " Gaussians beside each other on every pixel of the surface, and parts that were cut out of fits "
                  "have at most ",
                  Fixed(most, 2))
            : Cat("there would be ", Number(crowd),
                  " Gaussians beside each other on every pixel of the surface, and fits of ",
                  WithThousands(evidence.gaussians), evidence.gaussians >= int64_t{kMostShowing} ? " and more" : "",
                  " keep at most ", Number(most)));
  }
  const double left_out = estimate.cut_outlines + estimate.coarse_outlines;
  if (estimate.cut_outlines > kNothingButCuts) {
    finding.contradictions.push_back(
        Cat(Fixed(100 * estimate.cut_outlines, 0),
            " % of its outlines look as if a part had been cut off there, and say nothing about pixels"));
  } else if (left_out > kNothingButCuts) {
    finding.contradictions.push_back(
        Cat(Fixed(100 * left_out, 0),
            " % of its outlines are of Gaussians that are much coarser than the others, or look as if a part had been "
            "cut off there, and say nothing about pixels"));
  }
  if (estimate.of_antialiased && estimate.coarse_outlines > kCoarseOfRoom && estimate.strangeness > kStrangeOfRoom) {
    finding.contradictions.push_back(Cat(
        Fixed(100 * estimate.coarse_outlines, 0),
        " % of its outlines are of Gaussians that are much coarser than the others, and the rest is unlike those of "
        "fits, as of an object in a room"));
  }
  const bool of_many_pixels = evidence.dense < kSparseEnough * estimate.size || evidence.growth > kGrown;
  const bool uneven = evidence.unevenness > kMostUneven && of_many_pixels;
  if (uneven) {
    finding.no_one_pixel = true;
    finding.contradictions.push_back(std::isfinite(evidence.unevenness)
                                         ? Cat("a tenth of its Gaussians lie ", Number(evidence.unevenness),
                                               " times as far apart as another tenth, and those of one fit up to ",
                                               Number(kUneven), " times: they have no one pixel")
                                         : "a tenth of its Gaussians lie at one place, and those of fits do not");
  }
  const double by_outlines = estimate.size / estimate.softness;
  const bool filled = evidence.fill > kFills || evidence.small_axis < kSmallOfFlat * by_outlines;
  const bool flat = evidence.flatness < CloudShape::kFlat && filled && !evidence.sides.both_were_shown() &&
                    apart < kSparse * estimate.size &&
                    (estimate.strangeness > kStrangeOfFlat || estimate.disagreement < kDisagreeingOfFlat);
  if (flat) {
    finding.contradictions.emplace_back(
        "it is flat and its outlines are unlike those of fits, as of land seen from above: no picture may have shown "
        "them");
  } else if (estimate.disagreement < kRegressionsDisagree && !(evidence.all > 0 && evidence.all < kEnough)) {
    finding.contradictions.push_back(
        Cat("its Gaussians and outlines together say ", Fixed(estimate.disagreement, 2),
            " of what outlines alone do, as where pictures show no more than parts of it"));
  }
  finding.balls = evidence.roundness > kBalls;
  if (finding.balls) {
    finding.contradictions.emplace_back("its Gaussians are balls, whose sizes say nothing about pixels");
  }
  const bool small = evidence.small_axis < kSmallestAxis * by_outlines;
  // Soft pictures leave large Gaussians: where these are small, too, the outlines are of something else.
  if (small) {
    finding.contradictions.push_back(Cat("its small Gaussians measure ", Fixed(evidence.small_axis / by_outlines, 2),
                                         " of such a pixel, and those of fits 0.4 to 2.3"));
  }
  const double small_and_dense = std::sqrt(evidence.small_axis * evidence.dense);
  if (!small && small_and_dense > 0 && small_and_dense < kSmallAndDense * by_outlines) {
    finding.contradictions.push_back(Cat("its small Gaussians measure ", Fixed(evidence.small_axis / by_outlines, 2),
                                         " of such a pixel and its densest lie ",
                                         Fixed(evidence.dense / by_outlines, 2),
                                         " apart, and one of these is larger in fits"));
  }
  if (estimate.high > kNoEstimate * estimate.low) {
    finding.contradictions.push_back(
        Cat("anything from ", estimate.low, " to ", estimate.high, " would do, which is as good as no estimate"));
  }
  if (evidence.without_black > 0 && estimate.size > kMoved * evidence.without_black) {
    finding.contradictions.push_back(
        Cat("without its black Gaussians, which no picture shows, the outlines say ", evidence.without_black));
  }
  if (finding.part) finding.size *= std::exp(-kPartCaution * estimate.cut_outlines);
  double shrunk = finding.size;
  if (evidence.small_axis < kSmallAxis * estimate.size) {
    shrunk *= std::pow(evidence.small_axis / (kSmallAxis * estimate.size), kSmallFall);
  }
  if (evidence.unevenness > kUneven) {
    const double uneven_size = shrunk * std::pow(kUneven / evidence.unevenness, kUnevenFall);
    shrunk = of_many_pixels ? uneven_size : std::clamp(kOfDense * evidence.dense, uneven_size, shrunk);
  }
  if (!finding.contradicted()) finding.size = shrunk;
  finding.least = finding.size;
  if (finding.contradicted()) {
    double least = 0;
    // How many Gaussians a part had around it is not known, so how far above the bound it is says little.
    const bool crowd_alone = crowd > most && finding.contradictions.size() == 1 && estimate.cut_outlines < kLargelyCut;
    if (crowd_alone) least = estimate.size * std::pow(most / crowd, kCrowdedFall);
    if (uneven && finding.contradictions.size() == 1) least = shrunk;
    // Without its black Gaussians the outlines say a size, too; it counts where nothing contradicts that one.
    const double without = evidence.without_black;
    const bool one_pixel = !uneven && !flat && !finding.balls && left_out <= kNothingButCuts;
    if (without > 0 && one_pixel && crowd_at(without) <= most &&
        evidence.small_axis >= kSmallestAxis * without / evidence.softness_without_black) {
      least = std::max(least, without);
    }
    finding.size = std::min(finding.size, std::max(least, evidence.harmless));
    finding.least = std::min(least, finding.size);
  }
  finding.size = std::max(finding.size, kSomeSize * estimate.size);  // also where regions bear nothing
  if (evidence.closest < kCloser * evidence.of_many) finding.closer = kCloser * evidence.of_many;
  if (evidence.all > 0 && evidence.all < kEnough) {
    if (!finding.contradicted() && evidence.spacing < kClose * estimate.size) finding.of_more = finding.size;
    const double of_few = std::pow(static_cast<double>(evidence.all) / static_cast<double>(kEnough), kFewPower);
    finding.size = std::min(finding.size, estimate.size * of_few);
    finding.least = std::min(finding.least, finding.size);
    if (evidence.all < kFewGaussians) {
      finding.contradictions.push_back(
          Cat("it has ", WithThousands(evidence.all), " Gaussians, and outlines of so few are soft at any pixel"));
    }
  }
  return finding;
}

std::string PixelSizeFinding::SoftnessInWords() const {
  constexpr double kWorthAWord = 0.95;
  if (estimate.softness > kWorthAWord) return "";
  return Cat(Fixed(estimate.softness, 2),
             " of what its outlines say: they are softer than its Gaussians leave them, as after soft pictures");
}

std::string PixelSizeFinding::CutsInWords() const {
  if (!part) return "";
  return Cat(Fixed(100 * estimate.cut_outlines, 0),
             " % of the outlines look as if it had been cut there and do not count");
}

bool LiesAsFitsTo(double pixel, const PixelSizeFinding& finding) {
  return finding.dense > kTooSparse * finding.estimate.size && finding.dense > kDensest * pixel;
}

bool LiesTooCloseFor(double pixel, const PixelSizeFinding& finding) {
  return finding.dense > 0 && finding.dense < kDensest * pixel && pixel > kFarFromAll * finding.estimate.high;
}

bool IsSharperThanFitsTo(double pixel, const PixelSizeFinding& finding) {
  return finding.sure() && !LiesAsFitsTo(pixel, finding) && finding.largest < kSharperThanClassic * pixel &&
         finding.estimate.high < pixel;
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

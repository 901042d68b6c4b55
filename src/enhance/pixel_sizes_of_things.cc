#include "enhance/pixel_sizes_of_things.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/run_context.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/cloud_components.h"
#include "enhance/gaussian_regions.h"
#include "enhance/pixel_size_guard.h"
#include "enhance/showing_gaussians.h"
#include "enhance/trained_kind.h"

namespace anchorsplat {

namespace {

// Each takes as long as a splat of its own; those beyond are treated with caution.
constexpr size_t kMostThings = 16;
// Estimates that are no further apart are the same; up to the second they may be of one pixel: one estimate in twenty
// is off by more.
constexpr double kSame = 1.15, kAlike = 1.5;
constexpr double kNothing = 1e-12;  // of a pixel: none of the width that it would say
constexpr double kFew = 0.005;
constexpr double kNextToNone = 1e-6;  // of the largest: not worth a number
constexpr size_t kMostNamed = 4;      // as one reads
constexpr float kWithin = 0.02f;      // quantiles between which a thing lies
// Loose Gaussians and small pieces of one training are about as large as the others; of pixels half as large they are
// half as large, and thinned ones may lie as far apart all the same.
constexpr double kAsLarge = 0.6;
constexpr int64_t kLooseSamples = 256;

// What is looked at of a thing: no harmonics but the constant.
GaussianCloud ThingOf(const GaussianCloud& cloud, const std::vector<int64_t>& rows) {
  GaussianCloud out;
  out.Resize(std::ssize(rows), 0);
  out.render_mode = cloud.render_mode;
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  for (size_t k = 0; k < rows.size(); ++k) {
    const auto i = static_cast<size_t>(rows[k]);
    std::copy_n(cloud.means.data() + 3 * i, 3, out.means.data() + 3 * k);
    std::copy_n(cloud.log_scales.data() + 3 * i, 3, out.log_scales.data() + 3 * k);
    std::copy_n(cloud.quats.data() + 4 * i, 4, out.quats.data() + 4 * k);
    std::copy_n(cloud.sh.data() + stride * i, 3, out.sh.data() + 3 * k);
    out.opacity_logits[k] = cloud.opacity_logits[i];
  }
  return out;
}

struct Extent {
  std::array<float, 3> low, high;

  bool HasInside(const Extent& other) const {
    bool inside = true;
    for (size_t a = 0; a < 3; ++a) inside &= low[a] < other.low[a] && other.high[a] < high[a];
    return inside;
  }
};

Extent ExtentOf(const GaussianCloud& thing) {
  Extent extent;
  Buffer<float> along(static_cast<size_t>(thing.size()));
  for (size_t a = 0; a < 3; ++a) {
    for (size_t i = 0; i < along.size(); ++i) along[i] = thing.means[3 * i + a];
    extent.low[a] = Quantile(along, kWithin);
    extent.high[a] = Quantile(along, 1 - kWithin);
  }
  return extent;
}

// Regions get what they bear, and no more than the whole's.
PixelSizeFinding Unknown(const PixelSizeFinding& whole, std::string why) {
  PixelSizeFinding finding;
  finding.size = whole.size;
  finding.contradictions = {std::move(why)};
  return finding;
}

double MedianFootprint(const GaussianCloud& showing) {
  Buffer<float> footprint(static_cast<size_t>(showing.size()));
  for (size_t i = 0; i < footprint.size(); ++i) {
    const auto [smallest, middle, largest] = AxesOf(showing, i);
    footprint[i] = static_cast<float>(std::sqrt(middle * largest));
  }
  return double{Quantile(footprint, 0.5)};
}

// Whether loose Gaussians and small pieces are as large as those of the whole, and lie so far apart that no pixel of
// that size is too large for them.
bool AreAsCoarse(const GaussianCloud& loose, const GaussianCloud& whole, double size) {
  const GaussianCloud showing = FindShowingGaussians(loose).all;
  if (showing.empty()) return true;
  if (MedianFootprint(showing) < kAsLarge * MedianFootprint(FindShowingGaussians(whole).all)) return false;
  const GaussianRegions regions(showing);
  const int64_t count = showing.size(), samples = std::min(kLooseSamples, count);
  Buffer<float> spacing(static_cast<size_t>(samples));
  for (int64_t k = 0; k < samples; ++k) {
    const float* place = showing.means.data() + 3 * (k * count / samples);
    spacing[static_cast<size_t>(k)] = static_cast<float>(regions.Around(place).wide);
  }
  return double{Quantile(spacing, 0.1)} >= kSparseEnough * size;
}

bool Alike(double a, double b, double factor) { return a < factor * b && b < factor * a; }

// A thing of few Gaussians may be of the whole's training: its outlines say about the same.
void BelieveFew(const PixelSizeFinding& whole, PixelSizeFinding& finding) {
  if (whole.contradicted() || whole.of_more > 0 || !(finding.of_more > 0)) return;
  if (!Alike(finding.of_more, whole.size, kAlike)) return;
  finding.size = finding.least = std::min(finding.of_more, whole.size);
  finding.contradictions.clear();
}

}  // namespace

std::string InWords(std::span<const ThingPixelSize> things) {
  if (things.empty()) return "";
  std::string text = Cat(things.size(), " things that lie apart, each with a training pixel of its own: ");
  const double largest =
      std::ranges::max(things, {}, [](const ThingPixelSize& thing) { return thing.finding.size; }).finding.size;
  for (const auto& [gaussians, finding] : things.first(std::min(things.size(), kMostNamed))) {
    text += Cat(&finding == &things[0].finding ? "" : "; ", WithThousands(gaussians), " Gaussians, ");
    text += finding.size < kNextToNone * largest ? "next to none"
                                                 : Cat(finding.size, finding.least < finding.size ? " at most" : "");
    for (const std::string& sentence : finding.contradictions) {
      text += Cat(&sentence == &finding.contradictions[0] ? " (" : ", and ", sentence);
    }
    if (finding.contradicted()) text += ")";
  }
  if (things.size() <= kMostNamed) return text;
  const auto rest = things.subspan(kMostNamed);
  const auto doubtful = std::ranges::count_if(rest, [](const auto& thing) { return thing.finding.contradicted(); });
  return Cat(text, "; and ", rest.size(), " more", doubtful > 0 ? Cat(", ", doubtful, " of them doubtful") : "");
}

std::vector<std::string> ContradictionsOf(std::span<const ThingPixelSize> things) {
  std::vector<std::string> all;
  for (const auto& [gaussians, finding] : things) {
    for (const std::string& sentence : finding.contradictions) {
      all.push_back(Cat("of ", WithThousands(gaussians), " Gaussians that lie apart: ", sentence));
    }
  }
  return all;
}

PixelSizesOfThings FindPixelSizesOfThings(const GaussianCloud& cloud, const PixelSizeFinding& whole, bool kinds,
                                          const WholeCloud& harmonics) {
  const CloudComponents components = FindComponents(cloud);
  if (components.component.empty()) return {};
  const auto looked_at = std::min(static_cast<size_t>(components.count), kMostThings);
  std::vector<std::vector<int64_t>> rows(looked_at + 1);  // at last those of all others
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!HasUsableShape(cloud, i)) continue;
    const int32_t thing = components.component[static_cast<size_t>(i)];
    rows[thing < 0 ? looked_at : std::min(static_cast<size_t>(thing), looked_at)].push_back(i);
  }
  PixelSizesOfThings out;
  std::vector<Extent> extents;
  for (size_t k = 0; k < looked_at; ++k) {
    LeaveIfAbandoned();
    const GaussianCloud alone = ThingOf(cloud, rows[k]);
    extents.push_back(ExtentOf(alone));
    ThingPixelSize thing{std::ssize(rows[k]), Unknown(whole, "its outlines say nothing")};
    ShowingGaussians showing = FindShowingGaussians(alone);
    std::vector<int64_t> showing_rows;
    for (const int64_t own : showing.rows_of_all) {
      const int64_t row = rows[k][static_cast<size_t>(own)];
      showing_rows.push_back(harmonics.harmonics ? harmonics.rows[static_cast<size_t>(row)] : row);
    }
    const auto here = [&] { return harmonics.harmonics ? harmonics.harmonics() : CloudView(cloud); };
    const auto kind = kinds ? TrainedKindOf(showing.all, {showing_rows, here}) : std::nullopt;
    if (IsWide(BesideTag(kind, cloud.render_mode, showing.all.size()))) {
      thing.finding = Unknown(whole, "it looks as if it had been enhanced already, or had lost no width, and stays");
      thing.finding.size = kNothing * whole.size;
    } else if (auto found = FindPixelSize(std::move(showing), cloud.render_mode); found.ok()) {
      thing.finding = *std::move(found);
      BelieveFew(whole, thing.finding);
    }
    out.things.push_back(std::move(thing));
  }

  const auto all_like_whole = [&](double factor) {
    return !whole.contradicted() && std::ranges::all_of(out.things, [&](const ThingPixelSize& thing) {
      return !thing.finding.contradicted() && Alike(thing.finding.size, whole.size, factor);
    });
  };
  // A few floaters are not worth a word.
  const bool alone_matter = std::ssize(rows.back()) > static_cast<int64_t>(kFew * static_cast<double>(cloud.size()));
  if (!alone_matter && all_like_whole(kSame)) return {};
  const bool one_training = all_like_whole(kAlike);
  const bool like_others = one_training && 2 * std::ssize(rows.back()) < cloud.size() &&
                           static_cast<size_t>(components.count) <= looked_at &&
                           AreAsCoarse(ThingOf(cloud, rows.back()), cloud, whole.size);
  if (like_others && all_like_whole(kSame)) return {};
  for (size_t k = 0; k < looked_at; ++k) {
    PixelSizeFinding& finding = out.things[k].finding;
    if (std::ranges::any_of(extents, [&](const Extent& other) { return extents[k].HasInside(other); })) {
      finding.least = 0;
      finding.contradictions.emplace_back("it lies around others");
    }
    if (one_training) {
      finding.size = std::min(finding.size, whole.size);
      finding.least = std::min(finding.least, finding.size);
    }
  }
  PixelSizeFinding others = Unknown(whole, "these are pieces too small to tell, or lie by themselves");
  if (static_cast<size_t>(components.count) > looked_at) {
    others.contradictions = {Cat("these are of things beyond the ", kMostThings, " largest, or of pieces")};
  }
  for (const ThingPixelSize& thing : out.things) {
    if (thing.finding.size > 2 * kNothing * whole.size) others.size = std::min(others.size, thing.finding.size);
  }
  if (like_others) {
    others.least = others.size;
    others.contradictions.clear();
  }
  out.things.push_back({std::ssize(rows.back()), std::move(others)});

  out.sizes.assign(static_cast<size_t>(cloud.size()), static_cast<float>(kNothing * whole.size));
  out.sure.assign(out.sizes.size(), 0);
  for (size_t k = 0; k < out.things.size(); ++k) {
    const PixelSizeFinding& finding = out.things[k].finding;
    const Buffer<float> own = finding.is_one() ? Buffer<float>(rows[k].size(), static_cast<float>(finding.size))
                                               : CautiousPixelSizes(ThingOf(cloud, rows[k]), finding);
    for (size_t i = 0; i < own.size(); ++i) {
      const auto row = static_cast<size_t>(rows[k][i]);
      out.sizes[row] = own[i];
      out.sure[row] = finding.contradicted() ? 0 : 1;
    }
  }
  if (!alone_matter) out.things.pop_back();
  return out;
}

}  // namespace anchorsplat

#include "enhance/pixel_sizes_of_things.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/run_context.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/cloud_components.h"

namespace anchorsplat {

namespace {

// Each takes as long as a splat of its own; the smaller ones beyond are treated with caution.
constexpr size_t kMostThings = 16;
// Estimates that are no further apart are the same; up to the second they may be of one pixel: one estimate in twenty
// is off by more.
constexpr double kSame = 1.15, kAlike = 1.5;
constexpr size_t kMostNamed = 4;  // as one reads
constexpr float kWithin = 0.02f;  // quantiles between which a thing lies

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

bool Alike(double a, double b, double factor) { return a < factor * b && b < factor * a; }

}  // namespace

std::string InWords(std::span<const ThingPixelSize> things) {
  std::string text =
      Cat(things.size(), " things that lie apart, and each gets what its own outlines say of a training pixel: ");
  for (const auto& [gaussians, finding] : things.first(std::min(things.size(), kMostNamed))) {
    text += Cat(&finding == &things[0].finding ? "" : "; ", WithThousands(gaussians), " Gaussians, ", finding.size,
                finding.least < finding.size ? " at most" : "");
    for (const std::string& sentence : finding.contradictions) {
      text += Cat(&sentence == &finding.contradictions[0] ? " (" : ", and ", sentence);
    }
    if (finding.contradicted()) text += ")";
  }
  if (things.size() > kMostNamed) text += Cat("; and ", things.size() - kMostNamed, " more");
  return text;
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

PixelSizesOfThings FindPixelSizesOfThings(const GaussianCloud& cloud, const PixelSizeFinding& whole) {
  const CloudComponents components = FindComponents(cloud);
  if (components.count < 2) return {};
  std::vector<std::vector<int64_t>> rows(static_cast<size_t>(components.count));
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!HasUsableShape(cloud, i)) continue;
    rows[static_cast<size_t>(components.component[static_cast<size_t>(i)])].push_back(i);
  }
  PixelSizesOfThings out;
  std::vector<Extent> extents;
  for (size_t k = 0; k < rows.size(); ++k) {
    LeaveIfAbandoned();
    const GaussianCloud alone = ThingOf(cloud, rows[k]);
    extents.push_back(ExtentOf(alone));
    // What is too small to be looked at gets what its regions bear.
    PixelSizeFinding unknown;
    unknown.size = whole.size;
    unknown.contradictions = {"it is too small to tell"};
    const auto found = k < kMostThings ? FindPixelSize(alone) : Result<PixelSizeFinding>(Error{});
    out.things.push_back({std::ssize(rows[k]), found.ok() ? *found : std::move(unknown)});
  }

  const auto all_like_whole = [&](double factor) {
    return !whole.contradicted() && std::ranges::all_of(out.things, [&](const ThingPixelSize& thing) {
      return !thing.finding.contradicted() && Alike(thing.finding.size, whole.size, factor);
    });
  };
  if (all_like_whole(kSame)) return {};
  const bool one_training = all_like_whole(kAlike);
  out.sizes.assign(static_cast<size_t>(cloud.size()), static_cast<float>(whole.size));
  out.sure.assign(out.sizes.size(), 0);
  for (size_t k = 0; k < rows.size(); ++k) {
    PixelSizeFinding& finding = out.things[k].finding;
    if (std::ranges::any_of(extents, [&](const Extent& other) { return extents[k].HasInside(other); })) {
      finding.least = 0;
      finding.contradictions.emplace_back("it lies around others");
    }
    if (one_training) {
      finding.size = std::min(finding.size, whole.size);
      finding.least = std::min(finding.least, finding.size);
    }
    const Buffer<float> own = finding.is_one() ? Buffer<float>(rows[k].size(), static_cast<float>(finding.size))
                                               : CautiousPixelSizes(ThingOf(cloud, rows[k]), finding);
    for (size_t i = 0; i < own.size(); ++i) {
      const auto row = static_cast<size_t>(rows[k][i]);
      out.sizes[row] = own[i];
      out.sure[row] = finding.contradicted() ? 0 : 1;
    }
  }
  return out;
}

}  // namespace anchorsplat

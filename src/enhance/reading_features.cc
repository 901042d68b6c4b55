#include "enhance/reading_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "core/activations.h"
#include "core/lost_nothing_mark.h"
#include "core/run_context.h"
#include "core/spherical_harmonics.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/cloud_components.h"
#include "enhance/downscale_look.h"
#include "enhance/enhanced_look.h"
#include "enhance/pixel_size_features.h"
#include "enhance/pixel_size_guard.h"
#include "enhance/showing_gaussians.h"
#include "enhance/trained_kind.h"

namespace anchorsplat {

namespace {

constexpr int kReadingSteps = 7;
constexpr double kReadingOctaves = 0.5;
constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

class Row {
 public:
  explicit Row(ReadingFeatures& features) : out_(features) {}

  void Add(std::string name, double value) {
    out_.names.push_back(std::move(name));
    out_.values.push_back(std::isfinite(value) ? value : kNotKnown);
  }
  void Add(std::string_view prefix, std::span<const double> values) {
    for (size_t k = 0; k < values.size(); ++k) Add(Cat(prefix, k), values[k]);
  }
  // A length in the splat's unit.
  void AddLength(std::string name, double length) { AddLogLength(std::move(name), std::log(length)); }
  void AddLogLength(std::string name, double log_length) { Add(std::move(name), log_length - std::log(out_.unit)); }

 private:
  ReadingFeatures& out_;
};

double Count(int64_t count) { return std::log(static_cast<double>(std::max<int64_t>(1, count))); }

void AddFile(const GaussianCloud& cloud, Row& row) {
  for (const RenderMode mode : {RenderMode::kClassic, RenderMode::kAntialiased, RenderMode::kMip}) {
    row.Add(Cat("file.", NameOf(mode)), cloud.render_mode == mode ? 1 : 0);
  }
  row.Add("file.enhanced", HasMark(cloud.comments, kEnhancedMark) ? 1 : 0);
  row.Add("file.enhanced_in_part", HasMark(cloud.comments, kPartEnhancedMark) ? 1 : 0);
  row.Add("file.pixel_areas", HasMark(cloud.comments, kPixelAreaMark) ? 1 : 0);
  row.Add("file.sh_degree", cloud.sh_degree);
}

void AddCounts(const GaussianCloud& cloud, const ShowingGaussians& showing, Row& row) {
  row.Add("count.all", Count(cloud.size()));
  row.Add("count.showing", Count(showing.all.size()));
  const auto share = [](int64_t part, int64_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : kNotKnown;
  };
  row.Add("count.share_showing", share(showing.all.size(), showing.telling.cloud.size()));
  row.Add("count.share_bright", share(showing.bright.size(), showing.all.size()));
  const CloudComponents things = FindComponents(cloud);
  const auto largest = things.component.empty() ? cloud.size() : std::ranges::count(things.component, 0);
  row.Add("count.things", Count(things.count));
  row.Add("count.share_of_largest_thing", share(largest, cloud.size()));
}

void AddSizes(const PixelSizeProbe& probe, const GaussianCloud& showing, Row& row) {
  row.Add("size.", probe.SizesAt(probe.start()));
  Buffer<float> logits = showing.opacity_logits;
  for (int decile = 1; decile <= 9; ++decile) {
    row.Add(Cat("size.opacity", decile), logits.empty() ? kNotKnown : double{Sigmoid(Quantile(logits, decile / 10.0))});
  }
}

// The share of the values that are the most common one, within a thousandth: what a program set to one value.
double ShareOfTheSame(Buffer<float> values) {
  std::erase_if(values, [](float x) { return !std::isfinite(x); });
  if (values.empty()) return kNotKnown;
  constexpr float kSame = 1e-3f;
  std::ranges::sort(values);
  size_t most = 0;
  for (size_t first = 0, last = 0; last < values.size(); ++last) {
    while (values[last] - values[first] > kSame) ++first;
    most = std::max(most, last - first + 1);
  }
  return static_cast<double>(most) / static_cast<double>(values.size());
}

// Every Gaussian that shows counts alike, unlike in SizeFeatures: trainers are told apart by the smallest of them.
void AddAxes(const GaussianCloud& showing, Row& row) {
  std::array<Buffer<float>, 3> axes;
  for (int64_t i = 0; i < showing.size(); ++i) {
    std::array<float, 3> own;
    std::copy_n(showing.log_scales.data() + 3 * i, 3, own.begin());
    std::ranges::sort(own);
    for (size_t a = 0; a < 3; ++a) axes[a].push_back(own[a]);
  }
  for (size_t a = 0; a < 3; ++a) {
    for (const double q : {0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99}) {
      row.AddLogLength(Cat("axis", a, ".", q), axes[a].empty() ? kNotKnown : double{Quantile(axes[a], q)});
    }
  }
  row.Add("axis.same_smallest", ShareOfTheSame(axes[0]));
  row.Add("axis.same_opacity", ShareOfTheSame(showing.opacity_logits));
}

// Colours that no picture has, harmonics, and lengths of quaternions, which most programs write as 1.
void AddColorsAndTurns(const GaussianCloud& cloud, const ShowingGaussians& showing, Row& row) {
  double outside = 0, constant = 0, rest = 0, lengths = 0;
  for (const int64_t i : showing.rows_of_all) {
    const float* const sh = cloud.sh.data() + i * cloud.sh_stride();
    bool out = false;
    for (int64_t k = 0; k < cloud.sh_stride(); ++k) {
      const double value{sh[k]};
      if (k < 3) out = out || std::abs(value) * double{kSh0} > 0.5;
      (k < 3 ? constant : rest) += value * value;
    }
    outside += out ? 1 : 0;
    const float* const q = cloud.quats.data() + 4 * i;
    const double length =
        std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] + double{q[3]} * q[3]);
    lengths += std::min(1.0, std::abs(length - 1));
  }
  const auto count = static_cast<double>(std::max<size_t>(1, showing.rows_of_all.size()));
  row.Add("color.outside", outside / count);
  row.Add("color.harmonics", std::sqrt(rest / std::max(constant, 1e-12)));
  row.Add("turn.lengths", lengths / count);
}

void AddTails(const SizeTails& tails, Row& row) {
  row.Add("tail.gaussians", Count(tails.gaussians));
  row.Add("tail.middle", tails.middle);
  row.Add("tail.smallest", tails.smallest);
  row.Add("tail.roundness", tails.roundness);
  row.Add("tail.opaque", tails.opaque);
  row.Add("tail.faint", tails.faint);
  row.Add("tail.cut_off", tails.cut_off);
  row.Add("tail.raised", tails.raised ? 1 : 0);
}

void AddTwins(const GaussianCloud& cloud, const ShowingGaussians& showing, const SizeTails& tails, Row& row) {
  FoundTwins twins;
  const std::optional<EnhancedLook> look = FindEnhancedLook(showing.all, tails, &twins);
  std::array<double, kEnhancedLookFeatures> unknown;
  unknown.fill(kNotKnown);
  row.Add("twin.", look ? *look : unknown);
  row.Add("twin.unrelated", look ? (twins.unrelated ? 1.0 : 0.0) : kNotKnown);
  row.Add("twin.likeness_of_harmonics",
          look ? LikenessOfHarmonics(cloud, showing.rows_of_all, twins).value_or(kNotKnown) : kNotKnown);
  row.Add("twin.trained_quaternions", HasQuaternionsOfTraining(showing.all) ? 1 : 0);
}

void AddSurface(const GaussianCloud& bright, Row& row) {
  const PixelSizeEvidence evidence = EvidenceOfSurface(bright);
  row.AddLength("surface.spacing", evidence.spacing);
  row.AddLength("surface.footprint", evidence.footprint);
  row.AddLength("surface.of_many", evidence.of_many);
  row.AddLength("surface.dense", evidence.dense);
  row.AddLength("surface.closest", evidence.closest);
  row.AddLength("surface.harmless", evidence.harmless);
  row.Add("surface.unevenness", std::log(evidence.unevenness));
  row.Add("surface.growth", std::log(evidence.growth));
  row.Add("surface.flatness", evidence.flatness);
  row.Add("surface.fill", evidence.fill);
  row.Add("surface.roundness", evidence.roundness);
  row.Add("surface.shared", evidence.sides.shared);
  row.Add("surface.coarser", evidence.sides.coarser);
}

using OutlineValues = std::array<double, kOutlineValues>;

Result<OutlineValues> OutlinesAt(PixelSizeProbe& probe, double size, Look look) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelSizeFeatures features, probe.At(size, look));
  OutlineValues values;
  std::copy_n(features.begin(), values.size(), values.begin());  // the others are differences of the sizes around it
  return values;
}

// `without`: a probe of the splat without black Gaussians, where there are some.
Status AddLooks(PixelSizeProbe& probe, std::optional<PixelSizeProbe>& without, DownscaleProbe& closer, Row& row) {
  for (int k = -kReadingSteps; k <= kReadingSteps; ++k) {
    LeaveIfAbandoned();
    const double size = probe.start() * std::exp2(k * kReadingOctaves);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const OutlineValues alpha, OutlinesAt(probe, size, Look::kAlpha));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const OutlineValues thin, OutlinesAt(probe, size, Look::kAntialiased));
    OutlineValues bright{};
    if (without) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(bright, OutlinesAt(*without, size, Look::kAlpha));
      for (size_t i = 0; i < bright.size(); ++i) bright[i] -= alpha[i];
    }
    row.Add(Cat("alpha[", k, "]."), alpha);
    row.Add(Cat("thin[", k, "]."), thin);
    row.Add(Cat("bright[", k, "]."), bright);
    row.Add(Cat("left[", k, "].cut"), probe.CutOutlines(size));
    row.Add(Cat("left[", k, "].coarse"), probe.CoarseOutlines(size));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const DownscaleLook classic, closer.At(size, RenderMode::kClassic));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const DownscaleLook antialiased, closer.At(size, RenderMode::kAntialiased));
    row.Add(Cat("closer[", k, "].classic"), classic);
    row.Add(Cat("closer[", k, "].antialiased"), antialiased);
  }
  return {};
}

}  // namespace

Result<ReadingFeatures> ReadFeatures(const GaussianCloud& cloud) {
  ShowingGaussians showing = FindShowingGaussians(cloud);
  ANCHORSPLAT_ASSIGN_OR_RETURN(DownscaleProbe closer, DownscaleProbe::Make(showing.telling));
  ReadingFeatures features;
  Row row(features);
  AddFile(cloud, row);
  AddCounts(cloud, showing, row);
  ANCHORSPLAT_ASSIGN_OR_RETURN(PixelSizeProbe probe, PixelSizeProbe::Make(std::move(showing.telling)));
  std::optional<PixelSizeProbe> without;
  if (showing.telling_not_black) {
    auto made = PixelSizeProbe::Make(std::move(*showing.telling_not_black));
    if (made.ok()) without = *std::move(made);
  }
  features.unit = probe.start();
  AddSizes(probe, showing.all, row);
  AddAxes(showing.all, row);
  AddColorsAndTurns(cloud, showing, row);
  const SizeTails tails = SizeTailsOf(showing.all);
  AddTails(tails, row);
  AddTwins(cloud, showing, tails, row);
  AddSurface(showing.bright, row);
  ANCHORSPLAT_RETURN_IF_ERROR(AddLooks(probe, without, closer, row));
  return features;
}

}  // namespace anchorsplat

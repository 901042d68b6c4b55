#include "formats/write_losses.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "core/parallel.h"
#include "core/splat_comments.h"
#include "core/statistics.h"
#include "core/text.h"
#include "core/world_up.h"
#include "formats/spz/spz_extensions.h"
#include "formats/spz/spz_reader.h"

namespace anchorsplat {

namespace {

constexpr int64_t kLossGrain = 1 << 14;

// Number of drawn Gaussians with a value that the format clamps.
struct Clamped {
  int64_t log_scales = 0, colors = 0, harmonics = 0;
};

bool AnyBeyond(const float* values, int64_t count, float min, float max) {
  return std::any_of(values, values + count, [&](float x) { return x < min || x > max; });
}

Clamped CountClamped(const FormatRange& range, const CloudView& cloud, int sh_degree) {
  const int64_t harmonics = 3 * (ShCoefficients(sh_degree) - 1);
  std::vector<Clamped> parts(static_cast<size_t>((cloud.size() + kLossGrain - 1) / kLossGrain));
  ParallelFor(0, cloud.size(), kLossGrain, [&](int64_t first, int64_t last) {
    Clamped& part = parts[static_cast<size_t>(first / kLossGrain)];
    for (int64_t i = first; i < last; ++i) {
      if (!HasUsableShape(cloud, i) || !IsOpaqueEnough(cloud.opacity_logits[static_cast<size_t>(i)])) continue;
      const float* sh = cloud.sh.data() + i * cloud.sh_stride();
      part.log_scales +=
          AnyBeyond(cloud.log_scales.data() + 3 * i, 3, range.log_scale_min, range.log_scale_max) ? 1 : 0;
      part.colors += AnyBeyond(sh, 3, -range.dc, range.dc) ? 1 : 0;
      if (std::isfinite(range.harmonics)) {
        part.harmonics += AnyBeyond(sh + 3, harmonics, -range.harmonics, range.harmonics) ? 1 : 0;
      }
    }
  });
  Clamped sum;
  for (const Clamped& part : parts) {
    sum.log_scales += part.log_scales;
    sum.colors += part.colors;
    sum.harmonics += part.harmonics;
  }
  return sum;
}

// "an SPZ file".
std::string AFileOf(const SplatFormat& format) { return Cat(format.article, " ", format.name, " file"); }

// Licences require credits to stay with a splat; losing other comments is only documented.
std::string CreditLoss(const SplatFormat& format, std::span<const std::string> comments) {
  const std::vector<std::string> credits = CreditsOf(comments);
  if (credits.empty() || format.comments != CommentPlace::kNone) return {};
  std::string list;
  for (const std::string& credit : credits) list += Cat(list.empty() ? "\"" : ", \"", Printable(credit), "\"");
  return Cat(AFileOf(format), " cannot store credits: publish ", list, " with it");
}

// Read back, the splat may look as if it had lost width.
std::string MarkLoss(const SplatFormat& format, std::span<const std::string> comments) {
  if (format.comments != CommentPlace::kNone) return {};
  if (std::ranges::none_of(comments, IsMark)) return {};
  const bool part = HasMark(comments, kPartEnhancedMark), enhanced = HasMark(comments, kEnhancedMark);
  return Cat(AFileOf(format), " cannot store that the splat was ",
             part       ? "partly enhanced: enhancing the whole file would make that part worse (keep a PLY for that)"
             : enhanced ? "enhanced: its Gaussians nearly always show it, but keep a PLY to be sure"
                        : "fitted to pixel areas: enhancing the file would make it worse (keep a PLY for that)");
}

// SPZ records kept in comments, which only SPZ stores.
std::string SpzRecordLoss(const SplatFormat& format, std::span<const std::string> comments) {
  if (format.comments == CommentPlace::kAll || format.declared_axes == DeclaredAxesOfSpz) return {};
  const std::string names = NamesOfSpzExtensions(comments);
  return names.empty() ? std::string() : Cat(AFileOf(format), " cannot store ", names, ": dropped");
}

// Readers of such a file assume the usual axis.
std::string UpLoss(const SplatFormat& format, std::span<const std::string> comments) {
  const auto up = UpOf({comments.begin(), comments.end()});
  if (!up || *up == kUsualUp || format.comments != CommentPlace::kNone) return {};
  return Cat(AFileOf(format), " cannot store the up direction, ", (*up)[0], " ", (*up)[1], " ", (*up)[2],
             ": viewers assume the usual axis (convert --up turns the splat)");
}

// Without its tag, a splat is drawn as classic.
std::string ModeLoss(const SplatFormat& format, std::optional<RenderMode> mode) {
  if (!IsCompensated(mode) || format.mode_tag == ModeTag::kEach) return {};
  const std::string_view name = NameOf(*mode);
  if (format.mode_tag == ModeTag::kNone) {
    return Cat(AFileOf(format), " cannot store the render mode ", name,
               ": the splat will be drawn as classic (pass --mode ", name, " to verbs that have it)");
  }
  if (*mode == RenderMode::kAntialiased) return {};
  return Cat(AFileOf(format), " can only store that opacity is compensated, not the render mode ", name,
             ": the splat will be drawn with a dilation of ", DilationOf(RenderMode::kAntialiased), " px² instead of ",
             DilationOf(*mode), " (pass --mode ", name, " to verbs that have it)");
}

std::string OriginLoss(const SplatFormat& format, const WorldOrigin& origin) {
  if (format.keeps_origin || IsZero(origin)) return {};
  return Cat(AFileOf(format), " cannot store the origin of its positions: they are relative to ", TextOf(origin),
             "; keep these numbers with it");
}

}  // namespace

std::vector<std::string> WriteLosses(const SplatFormat& format, const CloudView& cloud) {
  const FormatRange& range = format.range;
  std::vector<std::string> losses;
  if (cloud.sh_degree > range.sh_degree) {
    losses.push_back(Cat(AFileOf(format), " cannot store spherical harmonics above degree ", range.sh_degree,
                         ": those of degree ", range.sh_degree + 1, " to ", cloud.sh_degree,
                         " are dropped, so colours no longer change with the view"));
  }
  const Clamped clamped = CountClamped(range, cloud, std::min(cloud.sh_degree, range.sh_degree));
  const auto add = [&](int64_t count, const std::string& what) {
    if (count == 0) return;
    losses.push_back(Cat(WithThousands(count), " of ", WithThousands(cloud.size()), " Gaussians have ", what,
                         ", the range of ", format.name, ": clamped to it"));
  };
  add(clamped.log_scales, Cat("log-scales beyond ", range.log_scale_min, " to ", range.log_scale_max, " (lengths of ",
                              std::exp(range.log_scale_min), " to ", std::exp(range.log_scale_max), ")"));
  add(clamped.colors, Cat("f_dc beyond ±", range.dc));
  add(clamped.harmonics, Cat("spherical harmonics beyond ±", range.harmonics));
  if (std::string loss = ModeLoss(format, cloud.render_mode); !loss.empty()) losses.push_back(std::move(loss));
  if (std::string loss = OriginLoss(format, cloud.origin); !loss.empty()) losses.push_back(std::move(loss));
  if (std::string loss = CreditLoss(format, cloud.comments); !loss.empty()) losses.push_back(std::move(loss));
  if (std::string loss = MarkLoss(format, cloud.comments); !loss.empty()) losses.push_back(std::move(loss));
  if (std::string loss = UpLoss(format, cloud.comments); !loss.empty()) losses.push_back(std::move(loss));
  if (std::string loss = SpzRecordLoss(format, cloud.comments); !loss.empty()) losses.push_back(std::move(loss));
  if (format.mean_loss != nullptr) {
    if (std::string loss = format.mean_loss(cloud); !loss.empty()) losses.push_back(std::move(loss));
  }
  return losses;
}

MiddleOfMeans FindMiddleOfMeans(const CloudView& cloud, double share) {
  constexpr int64_t kSamples = 1 << 16;
  const int64_t step = (cloud.size() + kSamples - 1) / kSamples;
  MiddleOfMeans middle;
  for (size_t axis = 0; axis < 3 && step > 0; ++axis) {
    std::vector<float> values;
    for (int64_t i = 0; i < cloud.size(); i += step) {
      if (HasUsableShape(cloud, i)) values.push_back(cloud.means[static_cast<size_t>(3 * i) + axis]);
    }
    if (values.empty()) continue;
    const float low = Quantile(values, 0.5 - share / 2), high = Quantile(values, 0.5 + share / 2);
    middle.extent = std::max(middle.extent, high - low);
    middle.farthest = std::max({middle.farthest, std::fabs(low), std::fabs(high)});
  }
  return middle;
}

}  // namespace anchorsplat

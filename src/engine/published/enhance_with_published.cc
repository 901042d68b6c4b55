#include "published/enhance_with_published.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "core/log.h"
#include "core/most_visible.h"
#include "core/parallel.h"
#include "core/text.h"
#include "published/spatial_blocks.h"

namespace anchorsplat {

namespace {

constexpr float kLargestLogit = 20;
constexpr float kMaxLogScale = 5;
constexpr float kLargestSh = 10;
// Anchors whose Gaussians are made at once: their 20 copies take 5 MB and stay in the cache until denormalised.
constexpr int64_t kHeadRows = 1024;
constexpr uint64_t kUpstreamSubsetSeed = 918;

// Replaces legal infinities (core/gaussian_cloud.h, IsUsable) by the nearest values the network can read: opacities 0
// and 1, and zero lengths of flat Gaussians, thin beside their longest axis. Empty if all values are finite.
std::optional<GaussianCloud> WithoutInfinities(const GaussianCloud& cloud) {
  constexpr float kThin = 10, kPoint = -20;  // ln: 1/22,000 of the longest axis; a length of 2e-9
  const auto infinite = [](float x) { return std::isinf(x); };
  if (std::none_of(cloud.opacity_logits.begin(), cloud.opacity_logits.end(), infinite) &&
      std::none_of(cloud.log_scales.begin(), cloud.log_scales.end(), infinite)) {
    return std::nullopt;
  }
  GaussianCloud finite = cloud;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!IsUsable(cloud, i)) continue;
    float& logit = finite.opacity_logits[static_cast<size_t>(i)];
    if (std::isinf(logit)) logit = std::clamp(logit, -kLargestLogit, kLargestLogit);
    float* s = finite.log_scales.data() + 3 * i;
    const float longest = std::max({s[0], s[1], s[2]});
    for (int a = 0; a < 3; ++a) {
      if (std::isinf(s[a])) s[a] = std::isinf(longest) ? kPoint : longest - kThin;
    }
  }
  return finite;
}

// torch.randperm(n)[:count] on PyTorch's CPU generator.
std::vector<int64_t> RandomChoice(std::vector<int64_t> rows, int64_t count) {
  std::mt19937 generator(static_cast<uint32_t>(kUpstreamSubsetSeed));
  const size_t n = rows.size();
  for (size_t i = 0; i + 1 < n; ++i) std::swap(rows[i], rows[i + static_cast<size_t>(generator()) % (n - i)]);
  rows.resize(static_cast<size_t>(count));
  return rows;
}

// Adds `weight` times a Gaussian, converted from normalised to world space, to output row `row`.
void AddRestored(const float* gaussian, const Normalisation& normalisation, float log_scale, float weight, int64_t row,
                 GaussianCloud& out) {
  const auto add = [weight](float& sum, float value) { sum = weight == 1 ? value : sum + weight * value; };
  for (size_t axis = 0; axis < 3; ++axis) {
    add(out.means.data()[3 * row + static_cast<int64_t>(axis)], normalisation.Undo(gaussian[axis], axis));
    add(out.log_scales.data()[3 * row + static_cast<int64_t>(axis)], gaussian[3 + axis] - log_scale);
  }
  add(out.opacity_logits.data()[row], gaussian[6]);
  for (int64_t c = 0; c < 4; ++c) add(out.quats.data()[4 * row + c], gaussian[7 + c]);
  for (int64_t c = 0; c < 48; ++c) add(out.sh.data()[48 * row + c], gaussian[11 + c]);
}

// Applies the release's bounds and normalises quaternions. Rows with NaN or infinity are left for DropRows: upstream
// too checks before it clamps.
void Finish(float anchor_log_scale, bool upstream, int64_t row, GaussianCloud& out) {
  const auto clamp = [](float& value, float low, float high) {
    if (std::isfinite(value)) value = std::clamp(value, low, high);
  };
  const float largest = upstream ? kMaxLogScale : std::max(kMaxLogScale, anchor_log_scale);
  for (int64_t a = 0; a < 3; ++a) {
    clamp(out.log_scales.data()[3 * row + a], std::numeric_limits<float>::lowest(), largest);
  }
  clamp(out.opacity_logits.data()[row], -kLargestLogit, kLargestLogit);
  for (int64_t c = 0; c < 48; ++c) clamp(out.sh.data()[48 * row + c], -kLargestSh, kLargestSh);
  if (upstream) return;
  float* quat = out.quats.data() + 4 * row;
  double square = 0;  // in double: squares of floats may overflow or underflow
  for (int c = 0; c < 4; ++c) square += double{quat[c]} * quat[c];
  const double norm = std::sqrt(square);
  if (norm > 0) {
    for (int c = 0; c < 4; ++c) quat[c] = static_cast<float>(quat[c] / norm);
  } else if (norm == 0) {
    quat[0] = 1;  // no rotation, as viewers show the zero quaternion
  }
}

// The normalisation that maps a block's cube to [0,1]³.
Normalisation NormalisationOf(const SpatialBlock& block, const Normalisation& whole) {
  // The block's cube is in coordinates of the whole cloud's cube.
  Normalisation result = whole;
  result.scale = static_cast<float>(whole.scale / block.side);
  for (size_t axis = 0; axis < 3; ++axis) {
    result.shift[axis] = static_cast<float>((whole.shift[axis] - block.corner[axis]) / block.side);
  }
  return result;
}

void ClampToCube(Buffer<float>& features) {
  for (size_t row = 0; row < features.size(); row += kFeatures) {
    for (size_t axis = 0; axis < 3; ++axis) features[row + axis] = std::clamp(features[row + axis], 0.0f, 1.0f);
  }
}

void SetZero(GaussianCloud& cloud) {
  for (Buffer<float>* values : {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh}) {
    float* begin = values->data();
    ParallelFor(0, static_cast<int64_t>(values->size()), 1 << 20,
                [&](int64_t first, int64_t last) { std::fill(begin + first, begin + last, 0.0f); });
  }
}

// Removes rows that are not finite or not visible.
void DropRows(GaussianCloud& out, const PublishedOptions& options, PublishedReport& report) {
  const float logit = options.prune_opacity > 0
                          ? std::log(options.prune_opacity) - std::log1p(-std::min(options.prune_opacity, 0.999999f))
                          : 0;
  int64_t kept = 0;
  for (int64_t i = 0; i < out.size(); ++i) {
    if (!IsFinite(out, i)) {
      ++report.output_not_finite;
      continue;
    }
    if (options.prune_opacity > 0 && out.opacity_logits[static_cast<size_t>(i)] < logit) {
      ++report.pruned;
      continue;
    }
    if (kept != i) {
      std::copy_n(out.means.data() + 3 * i, 3, out.means.data() + 3 * kept);
      std::copy_n(out.log_scales.data() + 3 * i, 3, out.log_scales.data() + 3 * kept);
      std::copy_n(out.quats.data() + 4 * i, 4, out.quats.data() + 4 * kept);
      out.opacity_logits[static_cast<size_t>(kept)] = out.opacity_logits[static_cast<size_t>(i)];
      std::copy_n(out.sh.data() + i * out.sh_stride(), out.sh_stride(), out.sh.data() + kept * out.sh_stride());
    }
    ++kept;
  }
  if (kept != out.size()) out.Resize(kept, out.sh_degree);
}

// Runs one block through the network and adds the result to its Gaussians' rows.
Status EnhanceBlock(const GaussianCloud& cloud, std::span<const int64_t> anchors, const SpatialBlock& block,
                    const Normalisation& normalisation, const PublishedNetwork& network,
                    const PublishedOptions& options, GaussianCloud& out, Progress& progress) {
  std::vector<int64_t> rows(block.rows.size());
  for (size_t j = 0; j < rows.size(); ++j) rows[j] = anchors[static_cast<size_t>(block.rows[j])];
  Buffer<float> features =
      FeatureRows(cloud, rows, normalisation, options.upstream ? ShPadding::kScrambled : ShPadding::kZeros);
  if (!options.upstream) ClampToCube(features);

  Buffer<float> context;
  {
    std::vector<Level> levels;
    {
      ProfileScope scope(options.profile, NetworkStep::kLevels);
      auto built = BuildHierarchy(GridVoxels(features.data(), static_cast<int64_t>(rows.size()), kFeatures),
                                  HierarchyOptionsFor(network.config(), options.shuffles, options.depth_rule));
      if (!built.ok()) return built.error();
      levels = *std::move(built);
    }
    context = network.Context(features.data(), levels, options.rounding, options.profile);
  }

  const int64_t copies = network.config().copies, width = network.config().context_channels();
  const auto n = static_cast<int64_t>(anchors.size()), block_rows = static_cast<int64_t>(rows.size());
  const float log_scale = normalisation.LogScale();
  Buffer<float> gaussians(static_cast<size_t>(copies * std::min(kHeadRows, block_rows) * kFeatures));
  double done = 0;
  for (int64_t begin = 0; begin < block_rows; begin += kHeadRows) {
    const int64_t count = std::min(kHeadRows, block_rows - begin);
    network.Gaussians(context.data() + begin * width, features.data() + begin * kFeatures, count, gaussians.data(),
                      options.profile);
    ParallelFor(0, copies * count, 1024, [&](int64_t first, int64_t last) {
      for (int64_t g = first; g < last; ++g) {
        const auto j = static_cast<size_t>(begin + g % count);
        const float weight = block.weights[j];
        if (weight == 0) continue;
        AddRestored(gaussians.data() + g * kFeatures, normalisation, log_scale, weight, g / count * n + block.rows[j],
                    out);
      }
    });
  }
  for (const float weight : block.weights) done += weight;
  progress.Advance(std::llround(done));
  return {};
}

// Rows the network can read, at most options.max_gaussians.
Result<std::vector<int64_t>> ChooseAnchors(const GaussianCloud& cloud, const PublishedOptions& options,
                                           PublishedReport& report) {
  std::vector<int64_t> anchors;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (IsFinite(cloud, i)) anchors.push_back(i);
  }
  report.not_finite = cloud.size() - static_cast<int64_t>(anchors.size());
  if (report.not_finite > 0) {
    LogWarning(Cat("dropped ", WithThousands(report.not_finite), " of ", WithThousands(cloud.size()),
                   " Gaussians with NaN or infinite values"));
  }
  if (options.max_gaussians > 0 && static_cast<int64_t>(anchors.size()) > options.max_gaussians) {
    report.over_limit = static_cast<int64_t>(anchors.size()) - options.max_gaussians;
    LogWarning(Cat("--max-gaussians: using ", WithThousands(options.max_gaussians), " of ",
                   WithThousands(static_cast<int64_t>(anchors.size())), " Gaussians, ",
                   options.upstream ? "chosen at random" : "those with the most opacity × size",
                   ", and dropping the others"));
    anchors = options.upstream ? RandomChoice(std::move(anchors), options.max_gaussians)
                               : MostVisible(cloud, anchors, options.max_gaussians);
  }
  if (!anchors.empty()) return anchors;
  return Error{ErrorCode::kBadArgument,
               cloud.empty() ? "the splat has no Gaussians" : "no Gaussian of the splat has finite values"};
}

// The anchors' means in the cube. Drops those outside it, where there is no grid: with `upstream` also those that
// rounding left just outside, by default only those that kUnit truly excludes.
Result<Buffer<float>> PlacesInCube(const GaussianCloud& cloud, const PublishedOptions& options,
                                   std::vector<int64_t>& anchors, PublishedReport& report) {
  Buffer<float> positions(anchors.size() * 3);
  for (size_t j = 0; j < anchors.size(); ++j) {
    std::copy_n(cloud.means.data() + 3 * anchors[j], 3, positions.data() + 3 * j);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(report.normalisation, FitNormalisation(positions, options.normalisation));
  const float tolerance = options.upstream ? 0.0f : 1e-5f;
  size_t inside = 0;
  for (size_t j = 0; j < anchors.size(); ++j) {
    bool keep = true;
    float moved[3];
    for (size_t axis = 0; axis < 3; ++axis) {
      moved[axis] = report.normalisation.Apply(positions[3 * j + axis], axis);
      keep = keep && moved[axis] >= -tolerance && moved[axis] <= 1 + tolerance;
    }
    if (!keep) continue;
    std::copy_n(moved, 3, positions.data() + 3 * inside);
    anchors[inside++] = anchors[j];
  }
  report.outside = static_cast<int64_t>(anchors.size() - inside);
  anchors.resize(inside);
  positions.resize(3 * inside);
  if (report.outside > 0) {
    LogWarning(Cat("dropped ", WithThousands(report.outside), " Gaussians outside the network's cube"));
  }
  if (anchors.empty()) return Error{ErrorCode::kBadArgument, "no Gaussian lies in the network's cube"};
  report.anchors = static_cast<int64_t>(anchors.size());
  return positions;
}

// Makes the copies of all anchors, block by block.
Result<GaussianCloud> EnhanceBlocks(const GaussianCloud& cloud, std::span<const int64_t> anchors,
                                    Buffer<float> positions, const PublishedNetwork& network,
                                    const PublishedOptions& options, PublishedReport& report) {
  SpatialBlockOptions block_options;
  block_options.most = options.upstream ? report.anchors : std::max<int64_t>(1, options.block_gaussians);
  const std::vector<SpatialBlock> blocks = SplitIntoBlocks(positions, {0, 0, 0}, 1, block_options);
  report.blocks = static_cast<int64_t>(blocks.size());
  positions = {};
  if (report.blocks > 1) {
    LogInfo(Cat(WithThousands(report.anchors), " Gaussians in ", report.blocks, " overlapping blocks of at most ",
                WithThousands(block_options.most)));
  }
  GaussianCloud out;
  out.Resize(report.anchors * network.config().copies, kMaxShDegree);
  if (blocks.size() > 1) SetZero(out);  // blocks add their weighted results
  Progress progress("Network", report.anchors);
  for (const SpatialBlock& block : blocks) {
    const Normalisation normalisation =
        blocks.size() == 1 ? report.normalisation : NormalisationOf(block, report.normalisation);
    ANCHORSPLAT_RETURN_IF_ERROR(EnhanceBlock(cloud, anchors, block, normalisation, network, options, out, progress));
  }
  return out;
}

// Bounds all output rows, then drops the unusable ones.
void FinishRows(const GaussianCloud& cloud, std::span<const int64_t> anchors, const PublishedOptions& options,
                GaussianCloud& out, PublishedReport& report) {
  ParallelFor(0, out.size(), 4096, [&](int64_t first, int64_t last) {
    for (int64_t row = first; row < last; ++row) {
      const float* s = cloud.log_scales.data() + 3 * anchors[static_cast<size_t>(row % report.anchors)];
      Finish(std::max({s[0], s[1], s[2]}), options.upstream, row, out);
    }
  });
  DropRows(out, options, report);
  if (report.output_not_finite > 0) {
    LogWarning(
        Cat("dropped ", WithThousands(report.output_not_finite), " NaN or infinite Gaussians of the network's output"));
  }
  if (report.pruned > 0) {
    LogInfo(Cat("pruned ", WithThousands(report.pruned), " Gaussians with opacity below ", options.prune_opacity));
  }
  report.gaussians_out = out.size();
}

Result<PublishedResult> Run(const GaussianCloud& given, const PublishedNetwork& network,
                            const PublishedOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(given));
  const std::optional<GaussianCloud> finite = options.upstream ? std::nullopt : WithoutInfinities(given);
  const GaussianCloud& cloud = finite ? *finite : given;
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options.shuffles));
  PublishedReport report;
  report.gaussians_in = cloud.size();
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<int64_t> anchors, ChooseAnchors(cloud, options, report));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Buffer<float> positions, PlacesInCube(cloud, options, anchors, report));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud out,
                               EnhanceBlocks(cloud, anchors, std::move(positions), network, options, report));
  out.render_mode = cloud.render_mode;
  out.comments = cloud.comments;
  FinishRows(cloud, anchors, options, out, report);
  return PublishedResult{std::move(out), report};
}

}  // namespace

Result<PublishedResult> EnhanceWithPublishedNetwork(const GaussianCloud& cloud, const PublishedNetwork& network,
                                                    const PublishedOptions& options) {
  if (!(options.prune_opacity >= 0 && options.prune_opacity <= 1)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("pruning: an opacity of ", options.prune_opacity, " is not between 0 and 1")};
  }
  try {
    return Run(cloud, network, options);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kBadArgument, Cat("not enough memory to make ", network.config().copies,
                                              " Gaussians of each of ", WithThousands(cloud.size()),
                                              "; a limit on the Gaussians or a model of a smaller factor needs less")};
  }
}

}  // namespace anchorsplat

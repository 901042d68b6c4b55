#include "fit/densification.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "fit/random_streams.h"

namespace anchorsplat {

namespace {

constexpr float kSplitShrink = 1.6f;  // factor by which halves of a split are smaller (Kerbl et al. 2023)
constexpr int kSplitSamples = 2;
constexpr int64_t kGaussiansPerTask = 4096;

// In `far` units, which are trivial for most fits.
float LargestLogScale(const FarUnits& far, const GaussianCloud& cloud, int64_t i) {
  const float* s = cloud.log_scales.data() + 3 * i;
  const float largest = std::max({s[0], s[1], s[2]});
  return far.any() ? largest - static_cast<float>(std::log(far.FactorAt(cloud.means.data() + 3 * i))) : largest;
}

float RevisedLogit(float logit) {
  const float opacity = Sigmoid(logit);
  return LogitFromOpacity(1 - std::sqrt(1 - opacity));
}

// Gaussians that grow.
struct Growth {
  std::vector<int64_t> duplicate, split;  // rows, ascending
};

// Thresholds of one refinement.
struct Rules {
  const DensificationOptions* options;
  const FarUnits* far;
  float log_grow_scale, log_prune_scale;  // ln(world units)
  bool prune_large;                       // after the first reset
  bool by_radius;                         // whether the 2-D rules apply
};

Rules MakeRules(const DensificationOptions& options, const FarUnits& far, int64_t step, double scene_scale) {
  return {&options,
          &far,
          static_cast<float>(std::log(options.grow_scale3d * scene_scale)),
          static_cast<float>(std::log(options.prune_scale3d * scene_scale)),
          step > options.reset_every,
          step < options.refine_scale2d_stop_iter};
}

Growth ChooseGrowth(const Rules& rules, const Densification::Gathered& gathered, const GaussianCloud& cloud) {
  const DensificationOptions& options = *rules.options;
  Growth growth;
  std::vector<float> gradients(static_cast<size_t>(cloud.size()));
  enum : uint8_t { kDuplicate = 1, kSplit = 2 };
  std::vector<uint8_t> grows(static_cast<size_t>(cloud.size()));
  ParallelFor(0, cloud.size(), kGaussiansPerTask, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const auto k = static_cast<size_t>(i);
      gradients[k] = gathered.grad2d[k] / std::max(gathered.count[k], 1.0f);
      const bool high = gradients[k] > static_cast<float>(options.grow_grad2d);
      const bool small = LargestLogScale(*rules.far, cloud, i) <= rules.log_grow_scale;
      const bool wide = rules.by_radius && gathered.radii[k] > static_cast<float>(options.grow_scale2d);
      // If both hold it is split, and its duplicate, which has no history, stays whole.
      grows[k] = static_cast<uint8_t>((high && small ? kDuplicate : 0) | ((high && !small) || wide ? kSplit : 0));
    }
  });
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const uint8_t how = grows[static_cast<size_t>(i)];
    if ((how & kDuplicate) != 0) growth.duplicate.push_back(i);
    if ((how & kSplit) != 0) growth.split.push_back(i);
  }

  const auto wanted = static_cast<int64_t>(growth.duplicate.size() + growth.split.size());
  const int64_t room = std::max<int64_t>(0, options.max_gaussians - cloud.size());
  if (options.max_gaussians <= 0 || wanted <= room) return growth;
  struct Candidate {
    float gradient;
    int64_t row;
    bool split;
  };
  std::vector<Candidate> candidates;
  for (const int64_t i : growth.duplicate) candidates.push_back({gradients[static_cast<size_t>(i)], i, false});
  for (const int64_t i : growth.split) candidates.push_back({gradients[static_cast<size_t>(i)], i, true});
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    if (a.gradient != b.gradient) return a.gradient > b.gradient;
    return a.row != b.row ? a.row < b.row : a.split < b.split;
  });
  candidates.resize(static_cast<size_t>(room));
  growth = {};
  for (const Candidate& c : candidates) (c.split ? growth.split : growth.duplicate).push_back(c.row);
  std::sort(growth.duplicate.begin(), growth.duplicate.end());
  std::sort(growth.split.begin(), growth.split.end());
  return growth;
}

std::vector<Newcomer> MakeNewcomers(const Growth& growth, const GaussianCloud& cloud, Random random) {
  std::vector<Newcomer> newcomers;
  newcomers.reserve(growth.duplicate.size() + kSplitSamples * growth.split.size());
  for (const int64_t i : growth.duplicate) newcomers.push_back({i, false, {0, 0, 0}});
  for (int sample = 0; sample < kSplitSamples; ++sample) {
    for (const int64_t i : growth.split) {
      const float* q = cloud.quats.data() + 4 * i;
      const float* s = cloud.log_scales.data() + 3 * i;
      const auto r = RotationFromQuaternion(q[0], q[1], q[2], q[3]);
      float along[3];
      for (size_t a = 0; a < 3; ++a) along[a] = std::exp(s[a]) * static_cast<float>(random.Normal());
      Newcomer half{i, true, {}};
      for (size_t a = 0; a < 3; ++a) {
        half.offset[a] = r[3 * a] * along[0] + r[3 * a + 1] * along[1] + r[3 * a + 2] * along[2];
      }
      newcomers.push_back(half);
    }
  }
  return newcomers;
}

// Whether a Gaussian is pruned.
bool IsPruned(const Rules& rules, bool usable, float logit, float largest_log_scale, float radius) {
  const DensificationOptions& options = *rules.options;
  if (!usable) return true;
  if (Sigmoid(logit) < static_cast<float>(options.prune_opa)) return true;
  if (!rules.prune_large) return false;
  return largest_log_scale > rules.log_prune_scale ||
         (rules.by_radius && radius > static_cast<float>(options.prune_scale2d));
}

void ChangeCloud(const DensificationOptions& options, const RowChange& change, const std::vector<Newcomer>& newcomers,
                 GaussianCloud& cloud) {
  const GaussianCloud old = std::exchange(cloud, GaussianCloud{});
  cloud.sh_degree = old.sh_degree;
  cloud.render_mode = old.render_mode;
  cloud.comments = old.comments;
  const int64_t stride = old.sh_stride();
  cloud.means = ChangeRows(old.means, 3, change);
  cloud.log_scales = ChangeRows(old.log_scales, 3, change);
  cloud.quats = ChangeRows(old.quats, 4, change);
  cloud.opacity_logits = ChangeRows(old.opacity_logits, 1, change);
  cloud.sh = ChangeRows(old.sh, stride, change);
  const auto kept = static_cast<int64_t>(change.kept.size());
  ParallelFor(0, static_cast<int64_t>(newcomers.size()), kGaussiansPerTask / 16, [&](int64_t first, int64_t last) {
    for (int64_t k = first; k < last; ++k) {
      const Newcomer& newcomer = newcomers[static_cast<size_t>(k)];
      const int64_t from = newcomer.source, to = kept + k;
      const NewcomerShape shape = ShapeOf(options, newcomer, old);
      for (int64_t a = 0; a < 3; ++a) {
        const auto out = static_cast<size_t>(3 * to + a), in = static_cast<size_t>(3 * from + a);
        cloud.means[out] = old.means[in] + newcomer.offset[a];
        cloud.log_scales[out] = shape.log_scales[static_cast<size_t>(a)];
      }
      std::copy_n(old.quats.data() + 4 * from, 4, cloud.quats.data() + 4 * to);
      cloud.opacity_logits[static_cast<size_t>(to)] = shape.opacity_logit;
      std::copy_n(old.sh.data() + stride * from, stride, cloud.sh.data() + stride * to);
    }
  });
}

}  // namespace

DensificationOptions ScaledTo(const DensificationOptions& options, int64_t steps) {
  const auto scaled = [&](int64_t count) { return count * steps / kStandardSteps; };
  DensificationOptions out = options;
  out.refine_scale2d_stop_iter = scaled(options.refine_scale2d_stop_iter);
  out.refine_start_iter = scaled(options.refine_start_iter);
  out.refine_stop_iter = scaled(options.refine_stop_iter);
  out.refine_every = std::max<int64_t>(1, scaled(options.refine_every));
  out.reset_every = std::max<int64_t>(1, scaled(options.reset_every));
  out.pause_refine_after_reset = scaled(options.pause_refine_after_reset);
  return out;
}

NewcomerShape ShapeOf(const DensificationOptions& options, const Newcomer& newcomer, const GaussianCloud& cloud) {
  NewcomerShape shape{};
  for (size_t a = 0; a < 3; ++a) {
    const float log_scale = cloud.log_scales[3 * static_cast<size_t>(newcomer.source) + a];
    shape.log_scales[a] = newcomer.half ? log_scale - std::log(kSplitShrink) : log_scale;
  }
  const float logit = cloud.opacity_logits[static_cast<size_t>(newcomer.source)];
  shape.opacity_logit = newcomer.half && options.revised_opacity ? RevisedLogit(logit) : logit;
  return shape;
}

void CapOpacities(GaussianCloud& cloud, double opacity) {
  const auto cap = static_cast<float>(std::log(opacity / (1 - opacity)));
  for (float& logit : cloud.opacity_logits) logit = std::min(logit, cap);
}

void Densification::Clear(int64_t gaussians) {
  for (Buffer<float>* array : {&gathered_.grad2d, &gathered_.count, &gathered_.radii}) {
    array->assign(static_cast<size_t>(gaussians), 0.0f);
  }
}

void Densification::Gather(bool absgrad, int width, int height, const CloudGradient& gradient) {
  const Buffer<float>& means2d = absgrad ? gradient.means2d_abs : gradient.means2d;
  const float half_width = 0.5f * static_cast<float>(width), half_height = 0.5f * static_cast<float>(height);
  const float side = static_cast<float>(std::max(width, height));
  ParallelFor(0, static_cast<int64_t>(gathered_.count.size()), 8192, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const auto k = static_cast<size_t>(i);
      const int32_t rx = gradient.radii[2 * k], ry = gradient.radii[2 * k + 1];
      if (rx <= 0 || ry <= 0) continue;
      const float gx = means2d[2 * k] * half_width, gy = means2d[2 * k + 1] * half_height;
      gathered_.grad2d[k] += std::sqrt(gx * gx + gy * gy);
      gathered_.count[k] += 1;
      gathered_.radii[k] = std::max(gathered_.radii[k], static_cast<float>(std::max(rx, ry)) / side);
    }
  });
}

RefinementPlan Densification::Plan(const DensificationOptions& options, int64_t step, double scene_scale, uint64_t seed,
                                   const FarUnits& far, const GaussianCloud& cloud,
                                   std::span<const uint8_t> usable) const {
  RefinementPlan plan;
  DensificationChange& change = plan.change;
  std::vector<Newcomer>& newcomers = plan.newcomers;
  const Rules rules = MakeRules(options, far, step, scene_scale);
  const Growth growth = ChooseGrowth(rules, gathered_, cloud);
  newcomers = MakeNewcomers(growth, cloud, RandomStream(seed, RandomPurpose::kSplit, step));

  std::vector<uint8_t> pruned(usable.size());
  ParallelFor(0, cloud.size(), kGaussiansPerTask, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const auto k = static_cast<size_t>(i);
      pruned[k] =
          IsPruned(rules, usable[k] != 0, cloud.opacity_logits[k], LargestLogScale(far, cloud, i), gathered_.radii[k]);
    }
  });
  // Pruning includes newcomers.
  std::erase_if(newcomers, [&](const Newcomer& newcomer) {
    const auto k = static_cast<size_t>(newcomer.source);
    const float logit = cloud.opacity_logits[k], size = LargestLogScale(far, cloud, newcomer.source);
    return IsPruned(rules, usable[k] != 0, newcomer.half && options.revised_opacity ? RevisedLogit(logit) : logit,
                    newcomer.half ? size - std::log(kSplitShrink) : size, gathered_.radii[k]);
  });
  RowChange& rows = change.rows;
  rows.kept.reserve(static_cast<size_t>(cloud.size()));
  auto next_split = growth.split.begin();
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (next_split != growth.split.end() && *next_split == i) {
      ++next_split;
      continue;
    }
    if (pruned[static_cast<size_t>(i)] == 0) rows.kept.push_back(i);
  }
  rows.fresh = static_cast<int64_t>(newcomers.size());
  change.duplicated = static_cast<int64_t>(growth.duplicate.size());
  change.split = static_cast<int64_t>(growth.split.size());
  const auto left = static_cast<int64_t>(rows.kept.size()) + rows.fresh;
  change.pruned = cloud.size() + change.duplicated + change.split - left;
  rows.any = rows.fresh > 0 || static_cast<int64_t>(rows.kept.size()) < cloud.size();
  return plan;
}

DensificationChange Densification::Refine(const DensificationOptions& options, int64_t step, double scene_scale,
                                          uint64_t seed, const FarUnits& far, GaussianCloud& cloud) {
  std::vector<uint8_t> usable(static_cast<size_t>(cloud.size()));
  ParallelFor(0, cloud.size(), kGaussiansPerTask, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) usable[static_cast<size_t>(i)] = IsUsable(cloud, i);
  });
  RefinementPlan plan = Plan(options, step, scene_scale, seed, far, cloud, usable);
  if (plan.change.rows.any) ChangeCloud(options, plan.change.rows, plan.newcomers, cloud);
  Clear(cloud.size());
  return std::move(plan.change);
}

bool Densification::Refines(const DensificationOptions& options, int64_t step) {
  return step < options.refine_stop_iter && step > options.refine_start_iter && step % options.refine_every == 0 &&
         step % options.reset_every >= options.pause_refine_after_reset;
}

bool Densification::ResetsOpacities(const DensificationOptions& options, int64_t step) {
  return step < options.refine_stop_iter && options.opacity_reset != OpacityReset::kNever &&
         step % options.reset_every == 0 && (step > 0 || options.opacity_reset == OpacityReset::kFromZero);
}

DensificationChange Densification::AfterGathering(const DensificationOptions& options, int64_t step, double scene_scale,
                                                  uint64_t seed, GaussianCloud& cloud, const FarUnits& far) {
  DensificationChange change;
  if (Refines(options, step)) change = Refine(options, step, scene_scale, seed, far, cloud);
  change.resets_opacities = ResetsOpacities(options, step);
  return change;
}

DensificationChange Densification::AfterStep(const DensificationOptions& options, int64_t step, double scene_scale,
                                             uint64_t seed, int width, int height, const CloudGradient& gradient,
                                             GaussianCloud& cloud, const FarUnits& far) {
  if (Gathers(options, step)) Gather(options.absgrad, width, height, gradient);
  return AfterGathering(options, step, scene_scale, seed, cloud, far);
}

}  // namespace anchorsplat

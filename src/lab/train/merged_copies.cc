#include "train/merged_copies.h"

#include <utility>
#include <vector>

#include "compact/copy_choice.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

using torch::Tensor;

constexpr double kLeastLength = 1e-4;  // of an axis, pixels; shorter ones get no gradient
constexpr double kAlmostEqual = 1e-2;  // relative difference of variances below which axes rotate freely
constexpr double kLeastClear = 0.02;   // lower bound of 1 − opacity

// Zero with the gradient of x.
Tensor Change(const Tensor& x) { return x - x.detach(); }

// Quaternions [M,4] to rotations [M,3,3], whose columns are the axes.
Tensor Rotation(const Tensor& quats) {
  const Tensor q = quats / quats.norm(2, 1, true).clamp_min(1e-12);
  const Tensor w = q.select(1, 0), x = q.select(1, 1), y = q.select(1, 2), z = q.select(1, 3);
  return torch::stack({1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
                       2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),  //
                       2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)},
                      1)
      .view({-1, 3, 3});
}

// Mean projected area over all directions up to a constant: √(tr adj Σ).
Tensor Area(const Tensor& covariance, double dilation) {
  const Tensor dilated = covariance + dilation * torch::eye(3);
  const Tensor trace = dilated.diagonal(0, 1, 2).sum(1);
  return (0.5 * (trace.square() - dilated.square().sum({1, 2}))).clamp_min(1e-12).sqrt();
}

// q ⊗ (1, v): rotated by the small rotation 2v in its own frame.
Tensor Turned(const Tensor& q, const Tensor& v) {
  const Tensor w = q.select(1, 0), a = q.select(1, 1), b = q.select(1, 2), c = q.select(1, 3);
  const Tensor x = v.select(1, 0), y = v.select(1, 1), z = v.select(1, 2);
  return torch::stack(
      {w - a * x - b * y - c * z, a + w * x + b * z - c * y, b + w * y + c * x - a * z, c + w * z + a * y - b * x}, 1);
}

struct Merges {
  GaussianCloud cloud;                // rows after the merge
  std::vector<int64_t> alone;         // unmerged rows
  std::vector<int64_t> merged;        // rows that absorbed others
  std::vector<int64_t> parts, whole;  // rows, and the index in `merged` that absorbed each
};

Merges Find(const GaussianTensors& all, const MergeRule& rule) {
  Merges out;
  out.cloud = ToCloud(all);
  out.cloud.render_mode = rule.mode;
  const Tensor pixels = rule.pixel_sizes.to(torch::kCPU, torch::kFloat32).contiguous();
  CopyGroups groups{.count = pixels.size(0), .copies = rule.copies, .pixel_sizes = {}};
  groups.pixel_sizes.assign(pixels.const_data_ptr<float>(), pixels.const_data_ptr<float>() + pixels.numel());
  const CopyPlan plan(std::move(groups), {.merge_cost = rule.cost}, out.cloud);
  const auto rows = static_cast<size_t>(out.cloud.size());
  std::vector<char> keep(rows, 1);
  std::vector<int64_t> into(rows);
  for (size_t row = 0; row < rows; ++row) into[row] = static_cast<int64_t>(row);
  std::vector<int64_t> parts_of(rows, 0), place(rows, -1);
  // Dropped copies belong to no merged one; their rows are not kept.
  plan.ApplyTo(out.cloud, keep, &into);
  for (size_t row = 0; row < rows; ++row) {
    if (keep[static_cast<size_t>(into[row])] != 0) ++parts_of[static_cast<size_t>(into[row])];
  }
  for (size_t row = 0; row < rows; ++row) {
    if (keep[row] == 0) continue;
    if (parts_of[row] < 2) {
      out.alone.push_back(static_cast<int64_t>(row));
    } else {
      place[row] = std::ssize(out.merged);
      out.merged.push_back(static_cast<int64_t>(row));
    }
  }
  for (size_t row = 0; row < rows; ++row) {
    if (const int64_t at = place[static_cast<size_t>(into[row])]; at >= 0) {
      out.parts.push_back(static_cast<int64_t>(row));
      out.whole.push_back(at);
    }
  }
  return out;
}

GaussianTensors Rows(const GaussianTensors& g, const Tensor& rows) {
  return {g.means.index_select(0, rows), g.log_scales.index_select(0, rows), g.quats.index_select(0, rows),
          g.opacity_logits.index_select(0, rows), g.sh.index_select(0, rows)};
}

}  // namespace

GaussianTensors MergedCopies(const GaussianTensors& all, const MergeRule& rule) {
  const Merges merges = Find(all, rule);
  if (std::ssize(merges.alone) == all.size()) return all;
  const auto index = [](const std::vector<int64_t>& rows) { return torch::tensor(rows, torch::kInt64); };
  const GaussianTensors alone = Rows(all, index(merges.alone));
  if (merges.merged.empty()) return alone;

  const Tensor whole = index(merges.whole), rows = index(merges.parts);
  const GaussianTensors parts = Rows(all, rows), out = Rows(ToTensors(merges.cloud), index(merges.merged));
  const int64_t count = out.size();
  const auto sum = [&](const Tensor& of_parts) {
    std::vector<int64_t> shape = of_parts.sizes().vec();
    shape[0] = count;
    return torch::zeros(shape).index_add(0, whole, of_parts);
  };
  const auto of_whole = [&](const Tensor& x) { return x.index_select(0, whole); };
  // In pixels, relative to the merged Gaussian.
  const double dilation = IsCompensated(rule.mode) ? 1e-3 : double{kDilation};
  const Tensor pixel_of_rows = rule.pixel_sizes.to(torch::kCPU, torch::kFloat32).repeat({rule.copies});
  const Tensor pixel = pixel_of_rows.index_select(0, index(merges.merged)).unsqueeze(1);
  const Tensor at = (parts.means - of_whole(out.means)) / of_whole(pixel);
  const Tensor turn = Rotation(parts.quats);
  const Tensor lengths = (parts.log_scales.exp() / of_whole(pixel)).clamp_min(kLeastLength);
  const Tensor sides = turn * lengths.unsqueeze(1);
  const Tensor covariance = sides.matmul(sides.transpose(1, 2));
  const Tensor mass = torch::sigmoid(parts.opacity_logits) * Area(covariance, dilation);
  const Tensor all_mass = sum(mass);
  const Tensor share = (mass / of_whole(all_mass)).unsqueeze(1);
  const Tensor mean = sum(share * at);
  const Tensor apart = (at - of_whole(mean)).unsqueeze(2);
  const Tensor spread = sum(share.unsqueeze(2) * (covariance + apart.matmul(apart.transpose(1, 2))));

  // Eigenvalues λᵢ and eigenvectors uᵢ: dλᵢ = uᵢᵀ dΣ uᵢ, duᵢ = Σⱼ uⱼ (uⱼᵀ dΣ uᵢ) / (λᵢ − λⱼ).
  const Tensor axes = Rotation(out.quats);
  const Tensor inside = axes.transpose(1, 2).matmul(Change(spread)).matmul(axes);
  const Tensor variance = (out.log_scales.exp() / pixel).clamp_min(kLeastLength).square();
  const auto turned = [&](int64_t i, int64_t j) {  // rotation of axis j towards i
    const Tensor a = variance.select(1, i), b = variance.select(1, j), difference = b - a;
    return inside.select(1, i).select(1, j) * difference / (difference.square() + (kAlmostEqual * (a + b)).square());
  };
  const Tensor rotation = torch::stack({turned(2, 1), turned(0, 2), turned(1, 0)}, 1);
  const Tensor clear = (1 - torch::sigmoid(out.opacity_logits)).clamp_min(kLeastClear);
  const Tensor opacity = Change(all_mass.log() - Area(spread, dilation).log()) / clear;

  const auto both = [](const Tensor& x, const Tensor& y) { return torch::cat({x, y}); };
  return {both(alone.means, out.means + pixel * Change(mean)),
          both(alone.log_scales, out.log_scales + 0.5 * inside.diagonal(0, 1, 2) / variance),
          both(alone.quats, Turned(out.quats, 0.5 * rotation)),
          both(alone.opacity_logits, out.opacity_logits + opacity),
          both(alone.sh, out.sh + Change(sum(share.unsqueeze(2) * parts.sh)))};
}

}  // namespace anchorsplat

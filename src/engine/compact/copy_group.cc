#include "compact/copy_group.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/activations.h"
#include "core/ellipsoid.h"
#include "core/rotation.h"
#include "core/spherical_harmonics.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<size_t, 3> kDiagonal = {0, 3, 5};  // of xx xy xz yy yz zz
constexpr float kBlack = -0.5f / kSh0;                  // coefficients below are clamped to black
constexpr double kMostStoredOpacity = 0.99;

std::array<double, 9> RotationOf(const GaussianCloud& cloud, int64_t row) {
  const float* q = cloud.quats.data() + 4 * row;
  return RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
}

// aᵀ b
std::array<double, 9> Relative(const std::array<double, 9>& a, const std::array<double, 9>& b) {
  std::array<double, 9> out{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) out[3 * i + j] = a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j];
  }
  return out;
}

// Mean over all directions of the product of two colours, summed over red, green and blue. SH are orthonormal, so it is
// an inner product of coefficients; colours below black count as black.
double ColorProduct(const float* a, const float* b, int64_t floats) {
  float sum = 0;
  for (int64_t c = 0; c < 3; ++c) sum += std::max(a[c], kBlack) * std::max(b[c], kBlack);
  for (int64_t c = 3; c < floats; ++c) sum += a[c] * b[c];
  return sum / (4 * std::numbers::pi);
}

}  // namespace

CopyGroup::CopyGroup(int64_t most, float invisible) : invisible_(std::max(invisible, kMinAlpha)) {
  const auto count = static_cast<size_t>(most);
  copies_.resize(count);
  color_products_.resize(count * count);
  weights_.resize(count * count);
  costs_.resize(count * count);
  loaded_.resize(count + 1);
  stand_in_products_.resize((count + 1) * (count + 1));
}

MergeGaussian CopyGroup::Seen(const GaussianCloud& cloud, int64_t row, double& stored_opacity) const {
  MergeGaussian g;
  const std::array<double, 9> turn = Relative(frame_, RotationOf(cloud, row));
  std::array<double, 3> shift, variance;
  for (size_t c = 0; c < 3; ++c) {
    shift[c] = (cloud.means[static_cast<size_t>(3 * row) + c] - origin_[c]) / pixel_;
    const double length = std::exp(double{cloud.log_scales[static_cast<size_t>(3 * row) + c]}) / pixel_;
    variance[c] = length * length;
  }
  g.thinnest = std::min({variance[0], variance[1], variance[2]});
  for (size_t c = 0; c < 3; ++c) {
    g.mean[c] = frame_[c] * shift[0] + frame_[3 + c] * shift[1] + frame_[6 + c] * shift[2];
  }
  size_t at = 0;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = i; j < 3; ++j, ++at) {
      g.covariance[at] = i == j ? dilation_ : 0;
      for (size_t c = 0; c < 3; ++c) g.covariance[at] += turn[3 * i + c] * variance[c] * turn[3 * j + c];
    }
  }
  stored_opacity = Sigmoid(double{cloud.opacity_logits[static_cast<size_t>(row)]});
  const double seen = VisibleVarianceShare(stored_opacity);
  for (double& x : g.covariance) x *= seen;
  g.opacity = std::max(0.0, stored_opacity - kMinAlpha) / seen;
  Measure(g);
  return g;
}

void CopyGroup::Load(const GaussianCloud& cloud, int64_t first, int64_t stride, int64_t copies, double pixel,
                     bool colors) {
  copies_.resize(static_cast<size_t>(copies));
  first_ = first;
  stride_ = stride;
  alive_ = copies;
  pixel_ = pixel;
  colors_ = colors;
  // Modes with compensation draw the Gaussian's integral undilated; a trace keeps flat ones from vanishing.
  dilation_ = IsCompensated(cloud.render_mode) ? 1e-3 : double{kDilation};
  frame_ = RotationOf(cloud, first);
  for (size_t c = 0; c < 3; ++c) origin_[c] = cloud.means[static_cast<size_t>(3 * first) + c];
  std::fill(weights_.begin(), weights_.end(), 0.0);
  for (size_t k = 0; k < copies_.size(); ++k) {
    const int64_t row = first + static_cast<int64_t>(k) * stride;
    copies_[k] = {};
    copies_[k].gaussian = loaded_[k] = Seen(cloud, row, copies_[k].stored_opacity);
    weights_[At(k, k)] = 1;
  }
  if (!colors) return;
  const int64_t floats = cloud.sh_stride();
  for (size_t a = 0; a < copies_.size(); ++a) {
    const float* of_a = cloud.sh.data() + (first + static_cast<int64_t>(a) * stride) * floats;
    for (size_t b = a; b < copies_.size(); ++b) {
      const float* of_b = cloud.sh.data() + (first + static_cast<int64_t>(b) * stride) * floats;
      color_products_[At(a, b)] = color_products_[At(b, a)] = ColorProduct(of_a, of_b, floats);
    }
  }
  for (size_t a = 0; a < copies_.size(); ++a) {
    for (size_t b = a + 1; b < copies_.size(); ++b) FindCost(a, b);
  }
}

void CopyGroup::FindCost(size_t a, size_t b) {
  const MergeGaussian &first = copies_[a].gaussian, &second = copies_[b].gaussian;
  double& cost = costs_[At(a, b)];
  cost = kInfinity;
  // These are dropped without merging.
  if (copies_[a].stored_opacity < invisible_ || copies_[b].stored_opacity < invisible_) return;
  const auto overlaps = Overlaps(first, second);
  const MergedPair merged = MergePair(first, second, overlaps, /*for_cost=*/true);
  if (!merged.valid) return;
  const double found = MergeCost(first, second, overlaps, merged,
                                 {color_products_[At(a, a)], color_products_[At(a, b)], color_products_[At(b, b)]});
  if (found < kInfinity) cost = found;  // NaN is none
}

double CopyGroup::Mass() const {
  double mass = 0;
  for (const Copy& copy : copies_) mass += copy.alive ? copy.gaussian.mass : 0;
  return mass;
}

double CopyGroup::CostOfStandIn(const GaussianCloud& cloud, int64_t row) {
  const size_t n = copies_.size(), all = n + 1;
  double stored_opacity = 0;
  loaded_[n] = Seen(cloud, row, stored_opacity);
  const int64_t floats = cloud.sh_stride();
  const auto colors = [&](size_t k) {
    return cloud.sh.data() + (k < n ? first_ + static_cast<int64_t>(k) * stride_ : row) * floats;
  };
  for (size_t i = 0; i < all; ++i) {
    for (size_t j = i; j < all; ++j) {
      const double product = ColorProduct(colors(i), colors(j), floats);
      stand_in_products_[i * all + j] = stand_in_products_[j * all + i] = product;
    }
  }
  // Where several copies have alpha, each contributes less, as if all were less opaque.
  double sum = 0;
  for (size_t k = 0; k < n; ++k) sum += loaded_[k].mass;
  const double less = Mass() / sum;
  // Colours relative to the copies' common mean, as in MergeCost().
  const auto with_mean = [&](size_t i) {
    double product = 0;
    for (size_t k = 0; k < n; ++k) product += loaded_[k].mass / sum * stand_in_products_[i * all + k];
    return product;
  };
  double mean_square = 0;
  for (size_t k = 0; k < n; ++k) mean_square += loaded_[k].mass / sum * with_mean(k);
  double cost = 0;
  for (size_t i = 0; i < all; ++i) {
    const double of_i = i < n ? less * loaded_[i].opacity : -loaded_[i].opacity;
    for (size_t j = 0; j <= i; ++j) {
      const double of_j = j < n ? less * loaded_[j].opacity : -loaded_[j].opacity;
      const std::array<double, 3> overlaps = Overlaps(loaded_[i], loaded_[j]);
      const double color = stand_in_products_[i * all + j] - with_mean(i) - with_mean(j) + mean_square;
      cost +=
          (i == j ? 1 : 2) * of_i * of_j * (overlaps[0] + overlaps[1] + overlaps[2]) * (color + 3 * kBehind * kBehind);
    }
  }
  return std::isfinite(cost) ? std::max(0.0, cost / 9) : kInfinity;
}

CopyGroup::Step CopyGroup::Next() const {
  // The most opaque copy stays, however faint.
  size_t seen = copies_.size();
  for (size_t k = 0; k < copies_.size(); ++k) {
    if (!copies_[k].alive) continue;
    if (seen == copies_.size() || copies_[k].stored_opacity > copies_[seen].stored_opacity) seen = k;
  }
  for (size_t k = 0; k < copies_.size(); ++k) {
    if (copies_[k].alive && k != seen && !(copies_[k].stored_opacity >= invisible_)) {
      return {0, static_cast<uint8_t>(k), static_cast<uint8_t>(k)};
    }
  }
  double least = kInfinity;
  size_t keep = 0, gone = 0;
  for (size_t a = 0; a < copies_.size(); ++a) {
    for (size_t b = a + 1; b < copies_.size(); ++b) {
      if (!copies_[a].alive || !copies_[b].alive || !(costs_[At(a, b)] < least)) continue;
      least = costs_[At(a, b)];
      keep = a;
      gone = b;
    }
  }
  if (least < kInfinity) {
    return {static_cast<float>(least), static_cast<uint8_t>(keep), static_cast<uint8_t>(gone)};
  }
  // Nothing can be merged: drops the last copy that is not the most opaque.
  for (size_t k = copies_.size(); k-- > 0;) {
    if (copies_[k].alive && k != seen) gone = k;
  }
  return {std::numeric_limits<float>::infinity(), static_cast<uint8_t>(gone), static_cast<uint8_t>(gone)};
}

void CopyGroup::Apply(const Step& step) {
  Copy &keep = copies_[step.keep], &gone = copies_[step.gone];
  gone.alive = false;
  --alive_;
  if (step.keep == step.gone) return;
  const MergedPair merged = MergePair(keep.gaussian, gone.gaussian, Overlaps(keep.gaussian, gone.gaussian));
  if (!merged.valid) return;  // then `gone` counts as invisible
  keep.gaussian = merged.gaussian;
  keep.stored_opacity = std::max(keep.stored_opacity, gone.stored_opacity);
  keep.merged = true;
  const double s = merged.share, t = 1 - s;
  const size_t a = step.keep, b = step.gone;
  for (size_t k = 0; k < copies_.size(); ++k) {
    weights_[At(a, k)] = s * weights_[At(a, k)] + t * weights_[At(b, k)];
  }
  if (!colors_) return;
  const double own =
      s * s * color_products_[At(a, a)] + 2 * s * t * color_products_[At(a, b)] + t * t * color_products_[At(b, b)];
  for (size_t k = 0; k < copies_.size(); ++k) {
    color_products_[At(a, k)] = color_products_[At(k, a)] =
        s * color_products_[At(a, k)] + t * color_products_[At(b, k)];
  }
  color_products_[At(a, a)] = own;
  for (size_t k = 0; k < copies_.size(); ++k) {
    if (k != a && copies_[k].alive) FindCost(std::min(a, k), std::max(a, k));
  }
}

bool CopyGroup::WriteMerged(const Copy& copy, const double* weights, int64_t row, GaussianCloud& cloud) const {
  const MergeGaussian& g = copy.gaussian;
  // Finds the opacity of the Gaussian with this visible part.
  double low = kMinAlpha, high = 1;
  for (int i = 0; i < 16; ++i) {
    const double opacity = std::sqrt(low * high);
    ((opacity - kMinAlpha) / VisibleVarianceShare(opacity) < g.opacity ? low : high) = opacity;
  }
  const double seen = VisibleVarianceShare(high);
  std::array<double, 6> covariance = g.covariance;
  for (double& x : covariance) x /= seen;
  for (const size_t diagonal : kDiagonal) covariance[diagonal] -= dilation_;
  Ellipsoid ellipsoid = EllipsoidOf(covariance);
  // No visible width is below the dilation: an axis that had to be lengthened lowers the opacity.
  MergeGaussian drawn;
  for (size_t c = 0; c < 3; ++c) {
    ellipsoid.variances[c] = std::max(ellipsoid.variances[c], g.thinnest);
    drawn.covariance[kDiagonal[c]] = ellipsoid.variances[c] + dilation_;
  }
  Measure(drawn);
  const double opacity = std::min(kMinAlpha + g.mass / drawn.mean_area, kMostStoredOpacity);
  std::array<float, 3> mean, log_scale;
  std::array<double, 9> axes{};
  for (size_t c = 0; c < 3; ++c) {
    const double moved = frame_[3 * c] * g.mean[0] + frame_[3 * c + 1] * g.mean[1] + frame_[3 * c + 2] * g.mean[2];
    mean[c] = static_cast<float>(origin_[c] + moved * pixel_);
    log_scale[c] = static_cast<float>(0.5 * std::log(ellipsoid.variances[c]) + std::log(pixel_));
    for (size_t a = 0; a < 3; ++a) {
      for (size_t k = 0; k < 3; ++k) axes[3 * c + a] += frame_[3 * c + k] * ellipsoid.axes[3 * k + a];
    }
    if (!std::isfinite(mean[c]) || !(log_scale[c] < kInfinity)) return false;
  }
  const auto quat = QuaternionFromRotation(axes);
  const int64_t floats = cloud.sh_stride();
  std::array<double, 3 * ShCoefficients(kMaxShDegree)> sh{};
  for (size_t k = 0; k < copies_.size(); ++k) {
    if (weights[k] == 0) continue;
    const float* from = cloud.sh.data() + (first_ + static_cast<int64_t>(k) * stride_) * floats;
    for (int64_t c = 0; c < floats; ++c) {
      sh[static_cast<size_t>(c)] += weights[k] * from[c];
    }
  }
  std::copy(mean.begin(), mean.end(), cloud.means.data() + 3 * row);
  std::copy(log_scale.begin(), log_scale.end(), cloud.log_scales.data() + 3 * row);
  for (size_t c = 0; c < 4; ++c) cloud.quats[static_cast<size_t>(4 * row) + c] = static_cast<float>(quat[c]);
  cloud.opacity_logits[static_cast<size_t>(row)] = static_cast<float>(std::log(opacity) - std::log1p(-opacity));
  for (int64_t c = 0; c < floats; ++c)
    cloud.sh.data()[row * floats + c] = static_cast<float>(sh[static_cast<size_t>(c)]);
  return true;
}

void CopyGroup::Write(GaussianCloud& cloud, std::vector<char>& keep, std::vector<int64_t>* into) const {
  for (size_t k = 0; k < copies_.size(); ++k) {
    const int64_t row = first_ + static_cast<int64_t>(k) * stride_;
    if (into != nullptr && copies_[k].alive) {
      // A copy's colour is the weighted mean of those merged into it.
      for (size_t from = 0; from < copies_.size(); ++from) {
        if (weights_[At(k, from)] != 0)
          (*into)[static_cast<size_t>(first_ + static_cast<int64_t>(from) * stride_)] = row;
      }
    }
    if (!copies_[k].alive) {
      keep[static_cast<size_t>(row)] = 0;
    } else if (copies_[k].merged) {
      // Does not fit in float: the first copy stays as it was.
      (void)WriteMerged(copies_[k], weights_.data() + At(k, 0), row, cloud);
    }
  }
}

}  // namespace anchorsplat

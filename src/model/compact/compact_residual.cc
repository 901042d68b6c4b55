#include "model/compact/compact_residual.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/widened.h"
#include "model/shared/normalisation.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

using Vector = std::array<double, 3>;

double Bounded(const CompactAttribute& attribute, double y) {
  return attribute.bound * std::tanh(attribute.gain * y / attribute.bound);
}

}  // namespace

double CubeSide(std::span<const float> means) {
  const auto normalisation = FitNormalisation(means, NormalisationMode::kAuto);
  return normalisation.ok() && normalisation->scale > 0 ? 1.0 / normalisation->scale : 0;
}

void WriteCopies(const CompactConfig& config, const CopyStart& start, const CompactAnchors& anchors, int64_t i,
                 const float* raw, float fade, int64_t row, int64_t stride, GaussianCloud& out) {
  const GaussianCloud& cloud = *anchors.cloud;
  const CompactGraph& graph = *anchors.graph;
  const double p = anchors.pixel_sizes[anchors.pixel_sizes.size() == 1 ? 0 : static_cast<size_t>(i)];
  const uint8_t* stored = graph.stored_axis.data() + 3 * i;
  const float* scales = cloud.log_scales.data() + 3 * i;
  const CopyStart::Shape shape = start.ShapeOf(cloud.opacity_logits[static_cast<size_t>(i)]);

  Vector log_scale;  // of the filtered Gaussian, longest axis first
  for (size_t a = 0; a < 3; ++a) log_scale[a] = scales[stored[a]];
  if (config.prior) {
    const double f = anchors.strength + Bounded(kStrengthAttribute, double{fade} * raw[0]);
    const double gain = std::max(kLeastGain, f - 1 / (anchors.upscale * anchors.upscale));
    const double log_variance = std::log(kDilation * gain) + 2 * std::log(p);
    for (double& s : log_scale) s = WidenedLogScale(s, log_variance);
  }
  Vector unit;
  for (size_t a = 0; a < 3; ++a) {
    unit[a] = config.epsilon * (config.offset_unit == OffsetUnit::kScale   ? std::exp(log_scale[a])
                                : config.offset_unit == OffsetUnit::kPixel ? p
                                                                           : anchors.offset_side);
  }
  // Turning by a vector of the frame is mirrored where the frame is.
  const float* axis = graph.axis(i, 0);
  const double handedness = (axis[1] * axis[5] - axis[2] * axis[4]) * axis[6] +
                                        (axis[2] * axis[3] - axis[0] * axis[5]) * axis[7] +
                                        (axis[0] * axis[4] - axis[1] * axis[3]) * axis[8] <
                                    0
                                ? -1
                                : 1;
  const auto to_world = [&](const Vector& v) {
    Vector world = {0, 0, 0};
    for (size_t a = 0; a < 3; ++a) {
      for (size_t c = 0; c < 3; ++c) world[c] += v[a] * axis[3 * a + c];
    }
    return world;
  };
  std::array<double, 4> quat;
  double norm = 0;
  for (size_t c = 0; c < 4; ++c) {
    quat[c] = cloud.quats[static_cast<size_t>(4 * i) + c];
    norm += quat[c] * quat[c];
  }
  norm = std::sqrt(norm);
  if (norm > 0) {
    for (double& x : quat) x /= norm;
  } else {
    quat = {1, 0, 0, 0};  // as core/rotation.h has it
  }

  const float* y = raw + 1;
  const auto next = [&](const CompactAttribute& attribute) { return Bounded(attribute, double{fade} * *y++); };
  for (int64_t k = 0; k < config.copies; ++k, row += stride) {
    Vector offset, turn;
    for (size_t a = 0; a < 3; ++a, ++y) {
      const double moved = double{fade} * *y;
      offset[a] = unit[a] * (config.anchors ? Bounded(kCopyAttributes[0], moved) : moved);
      if (a < 2) offset[a] += start.offset(k)[a] * std::exp(log_scale[a]);
    }
    Vector shift = to_world(offset);
    // Scales that float holds as logarithms but not as lengths leave no place to go to.
    if (!std::all_of(shift.begin(), shift.end(), [](double v) { return std::abs(v) < 1e30; })) shift = {0, 0, 0};
    float* out_scales = out.log_scales.data() + 3 * row;
    for (size_t a = 0; a < 3; ++a) {
      out.means.data()[3 * row + static_cast<int64_t>(a)] =
          static_cast<float>(cloud.means[static_cast<size_t>(3 * i) + a] + shift[a]);
      out_scales[stored[a]] = static_cast<float>(log_scale[a] + shape.log_shorter[a] + next(kCopyAttributes[1]));
    }
    for (size_t a = 0; a < 3; ++a) turn[a] = handedness * next(kCopyAttributes[2]);
    // The rotation by 2·atan(|t|/2) about t: its quaternion is (1, t/2) up to its norm.
    const Vector t = to_world(turn);
    const double x = t[0] / 2, yy = t[1] / 2, z = t[2] / 2;
    const double inverse = 1 / std::sqrt(1 + x * x + yy * yy + z * z);
    float* out_quat = out.quats.data() + 4 * row;
    out_quat[0] = static_cast<float>(inverse * (quat[0] - x * quat[1] - yy * quat[2] - z * quat[3]));
    out_quat[1] = static_cast<float>(inverse * (quat[1] + x * quat[0] + yy * quat[3] - z * quat[2]));
    out_quat[2] = static_cast<float>(inverse * (quat[2] - x * quat[3] + yy * quat[0] + z * quat[1]));
    out_quat[3] = static_cast<float>(inverse * (quat[3] + x * quat[2] - yy * quat[1] + z * quat[0]));
    const double logit = shape.opacity_logit + next(kCopyAttributes[3]);
    // K copies of something that float can hardly hold as a logit; −Inf stays, as the cloud may have it.
    out.opacity_logits[static_cast<size_t>(row)] = static_cast<float>(
        std::isinf(cloud.opacity_logits[static_cast<size_t>(i)]) ? logit : std::clamp(logit, -1e30, 1e30));

    const float* sh = cloud.sh.data() + i * cloud.sh_stride();
    float* out_sh = out.sh.data() + row * cloud.sh_stride();
    std::copy_n(sh, cloud.sh_stride(), out_sh);
    for (int64_t c = 0; c < 3; ++c) out_sh[c] = static_cast<float>(sh[c] + next(kCopyAttributes[4]));
    if (!config.sh) continue;
    for (int degree = 1; degree <= 3; ++degree) {
      const auto factor = static_cast<float>(1 + next(kCopyAttributes[5]));
      if (degree > cloud.sh_degree) continue;
      for (int64_t c = int64_t{3} * ShCoefficients(degree - 1); c < int64_t{3} * ShCoefficients(degree); ++c) {
        out_sh[c] *= factor;
      }
    }
    std::array<Vector, 3> linear;  // per colour, in the frame
    for (size_t a = 0; a < 3; ++a) {
      for (size_t c = 0; c < 3; ++c) linear[c][a] = next(kCopyAttributes[6]);
    }
    if (cloud.sh_degree < 1) continue;
    for (size_t c = 0; c < 3; ++c) {
      const Vector v = to_world(linear[c]);
      // The basis is (−y, z, −x), see ShBasis.
      out_sh[3 + c] -= static_cast<float>(v[1]);
      out_sh[6 + c] += static_cast<float>(v[2]);
      out_sh[9 + c] -= static_cast<float>(v[0]);
    }
  }
}

}  // namespace anchorsplat

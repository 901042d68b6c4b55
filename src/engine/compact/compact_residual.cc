#include "compact/compact_residual.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/widened.h"
#include "enhance/filter.h"
#include "network/normalisation.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

using Vector = std::array<double, 3>;

double Bounded(const CompactAttribute& attribute, double y) {
  return attribute.bound * std::tanh(attribute.gain * y / attribute.bound);
}

// Log-scales of the filtered Gaussian, longest axis first. `y`: the network's output for f.
Vector FilteredLogScales(const CompactConfig& config, const CompactAnchors& anchors, int64_t i, double p, double y) {
  const uint8_t* stored = anchors.graph->stored_axis.data() + 3 * i;
  const float* scales = anchors.cloud->log_scales.data() + 3 * i;
  Vector log_scale;
  for (size_t a = 0; a < 3; ++a) log_scale[a] = scales[stored[a]];
  if (config.prior) {
    const double f = anchors.strength + Bounded(kStrengthAttribute, y);
    const double shown = ShownStrength(anchors.upscale, anchors.cloud->render_mode);
    const double gain = std::max(kLeastGain, f - shown);
    const double log_variance = std::log(kDilation * gain) + 2 * std::log(p);
    for (double& s : log_scale) s = WidenedLogScale(s, log_variance);
  }
  return log_scale;
}

// ε in world units, per axis of the frame.
Vector OffsetUnits(const CompactConfig& config, const CompactAnchors& anchors, const Vector& log_scale, double p) {
  Vector unit;
  for (size_t a = 0; a < 3; ++a) {
    unit[a] = config.epsilon * (config.offset_unit == OffsetUnit::kScale   ? std::exp(log_scale[a])
                                : config.offset_unit == OffsetUnit::kPixel ? p
                                                                           : anchors.offset_side);
  }
  return unit;
}

// The frame of a Gaussian: three axes, longest first, row by row.
struct Frame {
  const float* axis;
  double handedness;  // −1 for a mirrored frame, in which rotation vectors change sign

  explicit Frame(const float* rows) : axis(rows) {
    const double triple = (rows[1] * rows[5] - rows[2] * rows[4]) * rows[6] +
                          (rows[2] * rows[3] - rows[0] * rows[5]) * rows[7] +
                          (rows[0] * rows[4] - rows[1] * rows[3]) * rows[8];
    handedness = triple < 0 ? -1 : 1;
  }
  Vector ToWorld(const Vector& v) const {
    Vector world = {0, 0, 0};
    for (size_t a = 0; a < 3; ++a) {
      for (size_t c = 0; c < 3; ++c) world[c] += v[a] * axis[3 * a + c];
    }
    return world;
  }
};

using Quaternion = std::array<double, 4>;  // w x y z

Quaternion UnitQuaternion(const GaussianCloud& cloud, int64_t i) {
  Quaternion quat;
  double norm = 0;
  for (size_t c = 0; c < 4; ++c) {
    quat[c] = cloud.quats[static_cast<size_t>(4 * i) + c];
    norm += quat[c] * quat[c];
  }
  norm = std::sqrt(norm);
  if (!(norm > 0)) return {1, 0, 0, 0};  // as core/rotation.h has it
  for (double& x : quat) x /= norm;
  return quat;
}

// `quat` rotated by 2·atan(|t|/2) about t: that rotation is (1, t/2) up to its norm.
void WriteTurned(const Quaternion& quat, const Vector& t, float* out) {
  const double x = t[0] / 2, y = t[1] / 2, z = t[2] / 2;
  const double inverse = 1 / std::sqrt(1 + x * x + y * y + z * z);
  out[0] = static_cast<float>(inverse * (quat[0] - x * quat[1] - y * quat[2] - z * quat[3]));
  out[1] = static_cast<float>(inverse * (quat[1] + x * quat[0] + y * quat[3] - z * quat[2]));
  out[2] = static_cast<float>(inverse * (quat[2] - x * quat[3] + y * quat[0] + z * quat[1]));
  out[3] = static_cast<float>(inverse * (quat[3] + x * quat[2] - y * quat[1] + z * quat[0]));
}

// Reads the outputs of one copy in order.
class Outputs {
 public:
  Outputs(const float* values, double fade) : next_(values), fade_(fade) {}
  double Raw() { return fade_ * *next_++; }
  double Next(const CompactAttribute& attribute) { return Bounded(attribute, Raw()); }

 private:
  const float* next_;
  double fade_;
};

// A copy's SH: the Gaussian's with a new mean, a gain per degree and a gradient across the sphere.
void WriteHarmonics(const CompactConfig& config, const GaussianCloud& cloud, const Frame& frame, const float* sh,
                    Outputs& y, float* out) {
  std::copy_n(sh, cloud.sh_stride(), out);
  for (int64_t c = 0; c < 3; ++c) out[c] = static_cast<float>(sh[c] + y.Next(kCopyAttributes[4]));
  if (!config.sh) return;
  for (int degree = 1; degree <= 3; ++degree) {
    const auto factor = static_cast<float>(1 + y.Next(kCopyAttributes[5]));
    if (degree > cloud.sh_degree) continue;
    for (int64_t c = int64_t{3} * ShCoefficients(degree - 1); c < int64_t{3} * ShCoefficients(degree); ++c) {
      out[c] *= factor;
    }
  }
  std::array<Vector, 3> linear;  // per colour, in the frame
  for (size_t a = 0; a < 3; ++a) {
    for (size_t c = 0; c < 3; ++c) linear[c][a] = y.Next(kCopyAttributes[6]);
  }
  if (cloud.sh_degree < 1) return;
  for (size_t c = 0; c < 3; ++c) {
    const Vector v = frame.ToWorld(linear[c]);
    // The basis is (−y, z, −x), see ShBasis.
    out[3 + c] -= static_cast<float>(v[1]);
    out[6 + c] += static_cast<float>(v[2]);
    out[9 + c] -= static_cast<float>(v[0]);
  }
}

}  // namespace

double CubeSide(std::span<const float> means) {
  const auto normalisation = FitNormalisation(means, NormalisationMode::kAuto);
  return normalisation.ok() && normalisation->scale > 0 ? 1.0 / normalisation->scale : 0;
}

void WriteCopies(const CompactConfig& config, const CopyStart& start, const CompactAnchors& anchors, int64_t i,
                 const float* raw, float fade, int64_t row, int64_t stride, GaussianCloud& out) {
  const GaussianCloud& cloud = *anchors.cloud;
  const auto at = static_cast<size_t>(i);
  const double p = anchors.pixel_sizes[anchors.pixel_sizes.size() == 1 ? 0 : at];
  const uint8_t* stored = anchors.graph->stored_axis.data() + 3 * i;
  const CopyStart::Shape shape = start.ShapeOf(cloud.opacity_logits[at]);
  Outputs y(raw, fade);
  const Vector log_scale = FilteredLogScales(config, anchors, i, p, y.Raw());
  const Vector unit = OffsetUnits(config, anchors, log_scale, p);
  const Frame frame(anchors.graph->axis(i, 0));
  const Quaternion quat = UnitQuaternion(cloud, i);

  for (int64_t k = 0; k < config.copies; ++k, row += stride) {
    Vector offset, turn;
    for (size_t a = 0; a < 3; ++a) {
      const double moved = y.Raw();
      offset[a] = unit[a] * (config.anchors ? Bounded(kCopyAttributes[0], moved) : moved);
      if (a < 2) offset[a] += start.offset(k)[a] * std::exp(log_scale[a]);
    }
    Vector shift = frame.ToWorld(offset);
    // A log-scale may be too large to be a length in float; then the copy is not moved.
    if (!std::all_of(shift.begin(), shift.end(), [](double v) { return std::abs(v) < 1e30; })) shift = {0, 0, 0};
    float* out_scales = out.log_scales.data() + 3 * row;
    for (size_t a = 0; a < 3; ++a) {
      out.means.data()[3 * row + static_cast<int64_t>(a)] =
          static_cast<float>(cloud.means[static_cast<size_t>(3 * i) + a] + shift[a]);
      out_scales[stored[a]] = static_cast<float>(log_scale[a] + shape.log_shorter[a] + y.Next(kCopyAttributes[1]));
    }
    for (size_t a = 0; a < 3; ++a) turn[a] = frame.handedness * y.Next(kCopyAttributes[2]);
    WriteTurned(quat, frame.ToWorld(turn), out.quats.data() + 4 * row);
    const double logit = shape.opacity_logit + y.Next(kCopyAttributes[3]);
    // Keeps the logit of each of K copies within float; −Inf is kept, as clouds may have it.
    out.opacity_logits[static_cast<size_t>(row)] =
        static_cast<float>(std::isinf(cloud.opacity_logits[at]) ? logit : std::clamp(logit, -1e30, 1e30));
    WriteHarmonics(config, cloud, frame, cloud.sh.data() + i * cloud.sh_stride(), y,
                   out.sh.data() + row * cloud.sh_stride());
  }
}

}  // namespace anchorsplat

#include "compact/compact_features.h"

#include <algorithm>
#include <cmath>

#include "core/vector3.h"

namespace anchorsplat {

namespace {

// ½·ln of a length over p_LR, clamped.
float HalfLog(float length_log, float pixel_log, float low, float high) {
  return std::clamp(0.5f * (length_log - pixel_log), low, high);
}

float RootMeanSquare(const float* values, int64_t count) {
  float sum = 0;
  for (int64_t k = 0; k < count; ++k) sum += values[k] * values[k];
  return std::sqrt(sum / static_cast<float>(count));
}

void Difference(const float* from, const float* to, float* d) {
  for (int c = 0; c < 3; ++c) d[c] = to[c] - from[c];
}

// asinh; the library's takes a third of an inference.
float Asinh(float x) { return std::copysign(std::log(std::abs(x) + std::sqrt(x * x + 1)), x); }

// Beyond all that clamped logarithms distinguish, and its square is finite.
constexpr float kFarthest = 1e15f;
// Keeps quotients by a pixel size finite in float.
// Quotients by these stay away from what float cannot hold.
constexpr float kSmallestPixel = 1e-20f, kLargestPixel = 1e20f;

}  // namespace

CompactFeatures::CompactFeatures(const GaussianCloud& cloud, const CompactGraph& graph, const Task& task)
    : cloud_(cloud),
      graph_(graph),
      pixel_sizes_(task.pixel_sizes),
      node_features_(task.node_features),
      upscale_feature_(static_cast<float>(0.5 * std::log2(task.upscale))),
      kind_{static_cast<float>(task.strength), cloud.render_mode == RenderMode::kAntialiased ? 1.0f : 0.0f,
            cloud.render_mode == RenderMode::kMip ? 1.0f : 0.0f} {}

std::array<float, 3> CompactFeatures::Widths(int64_t i) const {
  const float log_p = std::log(std::clamp(static_cast<float>(pixel_size(i)), kSmallestPixel, kLargestPixel));
  std::array<float, 3> widths;
  for (size_t a = 0; a < 3; ++a) {
    const size_t axis = 3 * static_cast<size_t>(i);
    widths[a] = 0.5f * (cloud_.log_scales[axis + graph_.stored_axis[axis + a]] - log_p);
  }
  return widths;
}

void CompactFeatures::Node(int64_t i, float* out) const {
  const int64_t m = graph_.neighbours;
  const float p = std::clamp(static_cast<float>(pixel_size(i)), kSmallestPixel, kLargestPixel);
  const float log_p = std::log(p);
  const std::array<float, 3> widths = Widths(i);
  for (size_t a = 0; a < 3; ++a) out[a] = std::clamp(widths[a], kLowestWidth, kHighestWidth);
  out[3] = std::clamp(0.25f * cloud_.opacity_logits[static_cast<size_t>(i)], -2.0f, 2.0f);
  const float* sh = cloud_.sh.data() + i * cloud_.sh_stride();
  for (int64_t c = 0; c < 3; ++c) out[4 + c] = std::clamp(0.5f * sh[c], -2.0f, 2.0f);
  std::fill(out + 7, out + 18, 0.0f);
  if (cloud_.sh_degree >= 1) {
    for (int64_t a = 0; a < 3; ++a) {
      const float* axis = graph_.axis(i, a);
      for (int64_t c = 0; c < 3; ++c) {
        // The basis is (−y, z, −x), see ShBasis.
        const float along = -axis[0] * sh[9 + c] - axis[1] * sh[3 + c] + axis[2] * sh[6 + c];
        out[7 + 3 * a + c] = std::clamp(2 * along, -2.0f, 2.0f);
      }
    }
  }
  if (cloud_.sh_degree >= 2) out[16] = std::min(5.0f, 5 * RootMeanSquare(sh + 12, 15));
  if (cloud_.sh_degree >= 3) out[17] = std::min(5.0f, 5 * RootMeanSquare(sh + 27, 21));
  out[kUpscaleFeature] = upscale_feature_;
  out[19] = out[20] = 3;
  if (m > 0) {
    const auto distance = [&](int64_t k) {
      float d[3];
      Difference(cloud_.means.data() + 3 * i,
                 cloud_.means.data() + int64_t{3} * graph_.index[static_cast<size_t>(i * m + k)], d);
      for (float& x : d) x = std::clamp(x, -kFarthest, kFarthest);
      return HalfLog(0.5f * std::log(Dot(d, d)), log_p, -3, 3);
    };
    out[19] = distance(0);
    out[20] = distance(m - 1);
  }
  std::copy_n(graph_.sidedness.data() + 3 * i, 3, out + 21);
  std::copy_n(kind_.begin(), node_features_ - kNodeFeatures, out + kNodeFeatures);
}

void CompactFeatures::Edges(int64_t i, float* out) const {
  const int64_t m = graph_.neighbours;
  const float p = std::clamp(static_cast<float>(pixel_size(i)), kSmallestPixel, kLargestPixel);
  const float log_p = std::log(p);
  const float* scales = cloud_.log_scales.data() + 3 * i;
  const float* sh = cloud_.sh.data() + i * cloud_.sh_stride();
  float width[3];
  for (int64_t a = 0; a < 3; ++a) {
    const float s = std::exp(std::min(30.0f, scales[graph_.stored_axis[static_cast<size_t>(3 * i + a)]] - log_p));
    width[a] = p * std::sqrt(s * s + 0.2f);
  }
  for (int64_t k = 0; k < m; ++k, out += kEdgeFeatures) {
    const int64_t j = graph_.index[static_cast<size_t>(i * m + k)];
    float d[3];
    Difference(cloud_.means.data() + 3 * i, cloud_.means.data() + 3 * j, d);
    for (float& x : d) x = std::clamp(x, -kFarthest, kFarthest);
    for (int64_t a = 0; a < 3; ++a) {
      const float along = Dot(graph_.axis(i, a), d);
      out[a] = std::clamp(0.5f * Asinh(along / p), -4.0f, 4.0f);
      out[4 + a] = std::clamp(0.5f * Asinh(along / width[a]), -4.0f, 4.0f);
    }
    out[3] = HalfLog(0.5f * std::log(Dot(d, d)), log_p, -3, 4);

    // Σ_b λ_b v_b v_bᵀ with v_b: axis b of j in i's frame.
    std::fill(out + 7, out + 13, 0.0f);
    const float* other_scales = cloud_.log_scales.data() + 3 * j;
    float cosine[3][3];
    for (int64_t b = 0; b < 3; ++b) {
      const float log_scale =
          HalfLog(other_scales[graph_.stored_axis[static_cast<size_t>(3 * j + b)]], log_p, kLowestWidth, kHighestWidth);
      float* v = cosine[b];
      for (int64_t a = 0; a < 3; ++a) v[a] = Dot(graph_.axis(i, a), graph_.axis(j, b));
      out[7] += log_scale * v[0] * v[0];
      out[8] += log_scale * v[1] * v[1];
      out[9] += log_scale * v[2] * v[2];
      out[10] += log_scale * v[0] * v[1];
      out[11] += log_scale * v[0] * v[2];
      out[12] += log_scale * v[1] * v[2];
    }
    out[13] = std::abs(cosine[0][0]);
    out[14] = std::abs(cosine[2][2]);
    const float* other_sh = cloud_.sh.data() + j * cloud_.sh_stride();
    for (int64_t c = 0; c < 3; ++c) out[15 + c] = std::clamp(0.5f * (other_sh[c] - sh[c]), -2.0f, 2.0f);
  }
}

void CompactFeatures::Nodes(std::span<const int32_t> rows, float* out) const {
  for (const int32_t row : rows) {
    Node(row, out);
    out += node_features_;
  }
}

void CompactFeatures::Edges(std::span<const int32_t> rows, float* out) const {
  for (const int32_t row : rows) {
    Edges(row, out);
    out += graph_.neighbours * kEdgeFeatures;
  }
}

void CompactFeatures::Nodes(int64_t begin, int64_t end, float* out) const {
  for (int64_t i = begin; i < end; ++i, out += node_features_) Node(i, out);
}

void CompactFeatures::Edges(int64_t begin, int64_t end, float* out) const {
  for (int64_t i = begin; i < end; ++i, out += graph_.neighbours * kEdgeFeatures) Edges(i, out);
}

}  // namespace anchorsplat

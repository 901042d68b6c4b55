#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "compact/compact_graph.h"
#include "core/buffer.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Input features of a compact network. Lengths are relative to p_LR or to the Gaussian, directions to the Gaussian's
// frame. So features do not change when a splat and its pixel are moved, rotated, mirrored or scaled together. All are
// bounded and of order 1.

// Node features, with s the scales longest first and p = p_LR:
//    0 – 2   ln(s/p)/2, within kLowestWidth … kHighestWidth
//    3       opacity logit / 4, within ±2
//    4 – 6   SH DC / 2, within ±2
//    7 – 15  SH degree 1 as a vector per colour along the three axes: axis-major, rgb fastest; times 2, within ±2
//   16, 17   RMS of the coefficients of degrees 2 and 3; times 5, at most 5
//   18       log2(u)/2
//   19, 20   ln(distance/p)/2 to the nearest and the farthest neighbour, within −3 … 3; 3 without neighbours
//   21 – 23  CompactGraph::sidedness
// With CompactConfig::knows_kind also, equal for all Gaussians of a splat:
//   24       strength f of the filter
//   25, 26   1 if the render mode is antialiased, mip
inline constexpr int64_t kNodeFeatures = 24, kMostNodeFeatures = 27;
inline constexpr int64_t kUpscaleFeature = 18;
inline constexpr float kLowestWidth = -3, kHighestWidth = 2;

// Edge features of neighbour j of i, with d = x_j − x_i:
//    0 – 2   asinh(d/p)/2 along i's axes, within ±4
//    3       ln(|d|/p)/2, within −3 … 4
//    4 – 6   asinh(d/√(s² + p²/5))/2: distance in terms of i's extent, within ±4
//    7 – 12  ½·ln of j's covariance over p_i² as a matrix in i's frame: xx yy zz xy xz yz. Eigenvalues (ln of j's
//            scales over p_i) within −3 … 2; varies smoothly where j is round
//   13, 14   |cos| of the angle between the longest axes, between the shortest
//   15 – 17  SH DC of j minus that of i, half, within ±2
inline constexpr int64_t kEdgeFeatures = 18;

// Computes features. Borrows cloud and graph, which must outlive this object.
class CompactFeatures {
 public:
  // The task, as far as features depend on it.
  struct Task {
    std::span<const float> pixel_sizes;     // p_LR, world units, one for all or one per Gaussian
    double upscale = 4;                     // u
    double strength = 0;                    // f of the filter
    int64_t node_features = kNodeFeatures;  // or kMostNodeFeatures
  };
  // The cloud must meet the requirements of BuildCompactGraph.
  CompactFeatures(const GaussianCloud& cloud, const CompactGraph& graph, const Task& task);

  void Node(int64_t i, float* out) const;   // [task.node_features]
  void Edges(int64_t i, float* out) const;  // [m, kEdgeFeatures]
  // For several Gaussians, rows concatenated.
  void Nodes(std::span<const int32_t> rows, float* out) const;
  void Edges(std::span<const int32_t> rows, float* out) const;
  void Nodes(int64_t begin, int64_t end, float* out) const;
  void Edges(int64_t begin, int64_t end, float* out) const;

  // The first three node features of Gaussian i without bounds; −Inf where a scale is 0.
  std::array<float, 3> Widths(int64_t i) const;

  double pixel_size(int64_t i) const { return pixel_sizes_[pixel_sizes_.size() == 1 ? 0 : static_cast<size_t>(i)]; }

 private:
  const GaussianCloud& cloud_;
  const CompactGraph& graph_;
  std::span<const float> pixel_sizes_;
  int64_t node_features_;
  float upscale_feature_;
  std::array<float, kMostNodeFeatures - kNodeFeatures> kind_;
};

}  // namespace anchorsplat

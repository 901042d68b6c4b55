#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "model/compact/compact_graph.h"

namespace anchorsplat {

// What a compact network is told. All lengths are in units of p_LR or of the Gaussian itself, all directions in the
// Gaussian's own frame, so nothing changes when a splat is moved, turned, mirrored or scaled together with its pixel.
// Everything is bounded, and of the order of 1.

// Of a Gaussian, with s its scales longest first, p its p_LR:
//    0 – 2   ln(s/p)/2, within kLowestWidth … kHighestWidth
//    3       opacity logit / 4, within ±2
//    4 – 6   SH DC / 2, within ±2
//    7 – 15  SH of degree 1 as a vector per colour, along the three axes: axis-major, rgb fastest; twice, within ±2
//   16, 17   root mean square of the coefficients of degree 2 and 3, five times, at most 5
//   18       log2(u)/2
//   19, 20   ln(distance/p)/2 of the nearest and of the farthest neighbour, within −3 … 3; 3 without neighbours
//   21 – 23  CompactGraph::sidedness
// And of networks that are told the kind of splat, the same for all of its Gaussians:
//   24       strength f of the filter
//   25, 26   1 where the render mode is antialiased, mip
inline constexpr int64_t kNodeFeatures = 24, kMostNodeFeatures = 27;
inline constexpr int64_t kUpscaleFeature = 18;
inline constexpr float kLowestWidth = -3, kHighestWidth = 2;

// Of a neighbour j of i, with d = x_j − x_i:
//    0 – 2   asinh(d/p)/2 along i's axes, within ±4
//    3       ln(|d|/p)/2, within −3 … 4
//    4 – 6   asinh(d/√(s² + p²/5))/2: how far out in i it lies, within ±4
//    7 – 12  ½·ln of j's covariance in units of p_i², the matrix in i's frame: xx yy zz xy xz yz. Eigenvalues within
//            −3 … 2 (half the logarithm of j's scales); smooth where j is round
//   13, 14   |cos| between the longest axes, between the shortest
//   15 – 17  SH DC of j minus that of i, half, within ±2
inline constexpr int64_t kEdgeFeatures = 18;

// The cloud with what features are made of at hand. Refers to cloud and graph, which must outlive it.
class CompactFeatures {
 public:
  // What features are asked for, and what the cloud does not say.
  struct Task {
    std::span<const float> pixel_sizes;     // p_LR, world units, one for all or one per Gaussian
    double upscale = 4;                     // u
    double strength = 0;                    // f of the filter
    int64_t node_features = kNodeFeatures;  // or kMostNodeFeatures
  };
  // See BuildCompactGraph about the cloud.
  CompactFeatures(const GaussianCloud& cloud, const CompactGraph& graph, const Task& task);

  void Node(int64_t i, float* out) const;   // [task.node_features]
  void Edges(int64_t i, float* out) const;  // [m, kEdgeFeatures]
  // Of many, one after the other.
  void Nodes(std::span<const int32_t> rows, float* out) const;
  void Edges(std::span<const int32_t> rows, float* out) const;
  void Nodes(int64_t begin, int64_t end, float* out) const;
  void Edges(int64_t begin, int64_t end, float* out) const;

  // The first three features of Gaussian i without their bounds; −Inf where a scale is 0.
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

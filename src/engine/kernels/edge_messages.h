#pragma once

#include <cstdint>

namespace anchorsplat {

// Message passing between points and their nearest neighbours, on a range of points. A point's edges are consecutive
// rows of the edge tables.

// edges[e] = gelu(edges[e] + own[i] + other[index[e]]) for each edge e of point i. This is the first layer of an MLP on
// [own state, neighbour's state, edge features], with the products for states computed once per point.
struct EdgeSumParams {
  int64_t points;        // in the range
  int64_t neighbours;    // m
  int64_t channels;      // C, a multiple of 16
  const float* own;      // [points,C] of the range
  const float* other;    // [N,C] of all points
  const int32_t* index;  // [points,m] of the range, into `other`
  float* edges;          // [points·m,C] in and out
};
void EdgeSumGeluCpu(const EdgeSumParams& p);

// Maximum and mean of each point's messages; zeros if m = 0.
struct EdgePoolParams {
  int64_t points;
  int64_t neighbours;  // m
  int64_t channels;    // C
  const float* edges;  // [points·m,C]
  int64_t out_stride;  // floats between points of `out`
  float* out;          // [points,2C] maximum | mean
};
void EdgePoolCpu(const EdgePoolParams& p);

}  // namespace anchorsplat

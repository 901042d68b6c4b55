#pragma once

#include <cstdint>

namespace anchorsplat {

// Messages between points and their nearest neighbours, on a range of points. The neighbours of a point are consecutive
// rows ("edges") of the tables of edges.

// edges[e] = gelu(edges[e] + own[i] + other[index[e]]) for the edges e of points i: the first layer of an MLP on
// [own state, neighbour's state, features of the edge], whose products with the states were made once per point.
struct EdgeSumParams {
  int64_t points;        // of the range
  int64_t neighbours;    // m
  int64_t channels;      // C, a multiple of 16
  const float* own;      // [points,C] of the range
  const float* other;    // [N,C] of all points
  const int32_t* index;  // [points,m] of the range, into `other`
  float* edges;          // [points·m,C] in and out
};
void EdgeSumGeluCpu(const EdgeSumParams& p);

// Maximum and mean of the messages to every point; zeros when m = 0.
struct EdgePoolParams {
  int64_t points;      //
  int64_t neighbours;  // m
  int64_t channels;    // C
  const float* edges;  // [points·m,C]
  int64_t out_stride;  // floats from point to point of `out`
  float* out;          // [points,2C] maximum | mean
};
void EdgePoolCpu(const EdgePoolParams& p);

}  // namespace anchorsplat

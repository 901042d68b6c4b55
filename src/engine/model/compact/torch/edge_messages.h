#pragma once

#include <torch/torch.h>

#include <cstdint>

namespace anchorsplat {

// Who hears from whom, both ways: neighbours of every point, and for every point the edges that bring it to others.
struct EdgeIndex {
  torch::Tensor index;           // [N·m] int64: the neighbour at the far end of each edge, point by point
  torch::Tensor incoming;        // [N·m] int64: edges by the point they read, in rising order
  torch::Tensor incoming_begin;  // [F+1] int64: where the edges of each point begin in `incoming`
  int64_t neighbours = 0;        // m
};
// Of `index` on the CPU: the edges of `points` points N, which are the first of `others` ≥ N points F that they read.
EdgeIndex MakeEdgeIndex(const torch::Tensor& index, int64_t points, int64_t others);

// Messages between neighbours, pooled: [maximum | mean] over the m edges of every point of
//     message(gelu(own_i + other_j + edge_weight · e_ij)),
// [N,2H], with the weights of linear layers ([outputs, inputs]). `own` is [N,H], `other` [F,H].
//
// On the CPU forward and backward go through the points in blocks that fit the cache and keep nothing per edge but
// where the maximum was: a table of all edges has m·H numbers per point, and passing one through memory a dozen times
// was most of a training step. The backward pass calculates the edges anew. The same bits for any number of threads.
torch::Tensor PooledMessages(const torch::Tensor& own, const torch::Tensor& other, const torch::Tensor& edges,
                             const EdgeIndex& index, const torch::Tensor& edge_weight,
                             const torch::Tensor& message_weight, const torch::Tensor& message_bias);

// The same as it is written, on any device.
torch::Tensor PooledMessagesPlain(const torch::Tensor& own, const torch::Tensor& other, const torch::Tensor& edges,
                                  const EdgeIndex& index, const torch::Tensor& edge_weight,
                                  const torch::Tensor& message_weight, const torch::Tensor& message_bias);

}  // namespace anchorsplat

#pragma once

#include <torch/torch.h>

#include <cstdint>

namespace anchorsplat {

// The edges of a neighbour graph in both directions.
struct EdgeIndex {
  torch::Tensor index;           // [N·m] int64: each edge's neighbour, point by point
  torch::Tensor incoming;        // [N·m] int64: edges sorted by neighbour
  torch::Tensor incoming_begin;  // [F+1] int64: start of each neighbour's edges in `incoming`
  int64_t neighbours = 0;        // m
};
// Indexes edges `index` (CPU) from N = `points` points to F = `others` ≥ N points, of which the N are the first.
EdgeIndex MakeEdgeIndex(const torch::Tensor& index, int64_t points, int64_t others);

// Message passing: pools [maximum | mean] over the m edges of every point, [N,2H], of
//     message(gelu(own_i + other_j + edge_weight · e_ij)).
// Weights are those of linear layers ([outputs, inputs]); `own` is [N,H], `other` [F,H].
//
// On the CPU both passes work in blocks that fit the cache. They store nothing per edge but the argmax: a table of all
// edges has m·H numbers per point, and passing it through memory a dozen times dominated a training step. The backward
// pass recomputes edges. The same bits for any number of threads.
torch::Tensor PooledMessages(const torch::Tensor& own, const torch::Tensor& other, const torch::Tensor& edges,
                             const EdgeIndex& index, const torch::Tensor& edge_weight,
                             const torch::Tensor& message_weight, const torch::Tensor& message_bias);

// Plain reference implementation, for any device.
torch::Tensor PooledMessagesPlain(const torch::Tensor& own, const torch::Tensor& other, const torch::Tensor& edges,
                                  const EdgeIndex& index, const torch::Tensor& edge_weight,
                                  const torch::Tensor& message_weight, const torch::Tensor& message_bias);

}  // namespace anchorsplat

#include "compact/torch/edge_messages.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace anchorsplat {

namespace {

using torch::Tensor;

// With 8 neighbours and 64 channels a block's edge tables take half a megabyte each.
constexpr int64_t kPointsPerBlock = 256;

// Views on a range of points and its tables.
struct EdgeBlock {
  int64_t begin, points, m;

  Tensor Points(const Tensor& table) const { return table.narrow(0, begin, points); }
  Tensor Edges(const Tensor& table) const { return table.narrow(0, begin * m, points * m); }
};

template <typename Body>
void ForEachBlock(int64_t n, int64_t m, Body&& body) {
  const int64_t blocks = (n + kPointsPerBlock - 1) / kPointsPerBlock;
  at::parallel_for(0, blocks, 1, [&](int64_t first, int64_t last) {
    const torch::NoGradGuard no_gradient;  // of this thread
    for (int64_t b = first; b < last; ++b) {
      const int64_t begin = b * kPointsPerBlock;
      body(b, EdgeBlock{begin, std::min(kPointsPerBlock, n - begin), m});
    }
  });
}

// own_i + other_j + W·e_ij of a block's edges.
Tensor Sums(const EdgeBlock& block, const Tensor& own, const Tensor& other, const Tensor& edges, const Tensor& index,
            const Tensor& edge_weight) {
  Tensor sums = torch::addmm(other.index_select(0, block.Edges(index)), block.Edges(edges), edge_weight.t());
  sums.view({block.points, block.m, -1}).add_(block.Points(own).unsqueeze(1));
  return sums;
}

// Maximum, argmax (the first of several) and mean of the messages [points·m,H]. By hand: torch's max with indices takes
// longer than the matrix products.
void Pool(const Tensor& messages, const Tensor& pooled, const Tensor& where) {
  const int64_t points = pooled.size(0), h = messages.size(1), m = messages.size(0) / points;
  const float* message = messages.const_data_ptr<float>();
  float* maximum = pooled.data_ptr<float>();
  int32_t* at = where.data_ptr<int32_t>();
  for (int64_t i = 0; i < points; ++i, maximum += 2 * h, at += h) {
    float* mean = maximum + h;
    std::copy_n(message, h, maximum);
    std::copy_n(message, h, mean);
    std::fill_n(at, h, 0);
    message += h;
    for (int32_t k = 1; k < m; ++k, message += h) {
      for (int64_t c = 0; c < h; ++c) {
        const bool larger = message[c] > maximum[c];
        maximum[c] = larger ? message[c] : maximum[c];
        at[c] = larger ? k : at[c];
        mean[c] += message[c];
      }
    }
    for (int64_t c = 0; c < h; ++c) mean[c] /= static_cast<float>(m);
  }
}

// Backward of Pool: ∂/∂pooled to ∂/∂messages.
void Unpool(const Tensor& of_pooled, const Tensor& where, const Tensor& of_messages) {
  const int64_t points = of_pooled.size(0), h = where.size(1), m = of_messages.size(0) / points;
  const float* maximum = of_pooled.const_data_ptr<float>();
  const int32_t* at = where.const_data_ptr<int32_t>();
  float* out = of_messages.data_ptr<float>();
  const float share = 1 / static_cast<float>(m);
  for (int64_t i = 0; i < points; ++i, maximum += 2 * h, at += h) {
    const float* mean = maximum + h;
    for (int32_t k = 0; k < m; ++k, out += h) {
      for (int64_t c = 0; c < h; ++c) out[c] = share * mean[c] + (at[c] == k ? maximum[c] : 0.0f);
    }
  }
}

class PooledMessagesFunction : public torch::autograd::Function<PooledMessagesFunction> {
 public:
  static Tensor forward(torch::autograd::AutogradContext* context, const Tensor& own, const Tensor& other,
                        const Tensor& edges, const Tensor& index, const Tensor& incoming, const Tensor& incoming_begin,
                        int64_t m, const Tensor& edge_weight, const Tensor& message_weight,
                        const Tensor& message_bias) {
    const int64_t n = own.size(0), h = own.size(1);
    const Tensor pooled = torch::empty({n, 2 * h}, own.options());
    const Tensor where = torch::empty({n, h}, torch::kInt32);
    ForEachBlock(n, m, [&](int64_t, const EdgeBlock& block) {
      const Tensor sums = Sums(block, own, other, edges, index, edge_weight);
      const Tensor messages = torch::addmm(message_bias, torch::gelu(sums), message_weight.t());
      Pool(messages, block.Points(pooled), block.Points(where));
    });
    context->save_for_backward(
        {own, other, edges, index, incoming, incoming_begin, edge_weight, message_weight, where});
    context->saved_data["m"] = m;
    return pooled;
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& gradients) {
    const auto saved = context->get_saved_variables();
    const Tensor &own = saved[0], &other = saved[1], &edges = saved[2], &index = saved[3], &incoming = saved[4],
                 &incoming_begin = saved[5], &edge_weight = saved[6], &message_weight = saved[7], &where = saved[8];
    const int64_t m = context->saved_data["m"].toInt(), n = own.size(0), h = own.size(1);
    const Tensor gradient = gradients[0].contiguous();
    const Tensor to_own = torch::empty_like(own), to_sums = torch::empty({n * m, h}, own.options());
    const auto blocks = static_cast<size_t>((n + kPointsPerBlock - 1) / kPointsPerBlock);
    std::vector<Tensor> to_edge_weight(blocks), to_message_weight(blocks), to_bias(blocks);  // summed in order
    ForEachBlock(n, m, [&](int64_t b, const EdgeBlock& block) {
      const Tensor sums = Sums(block, own, other, edges, index, edge_weight);
      const Tensor to_messages = torch::empty_like(sums);
      Unpool(block.Points(gradient), block.Points(where), to_messages);
      const auto place = static_cast<size_t>(b);
      to_message_weight[place] = to_messages.t().mm(torch::gelu(sums));
      to_bias[place] = to_messages.sum(0);
      const Tensor of_sums = at::gelu_backward(to_messages.mm(message_weight), sums);
      to_edge_weight[place] = of_sums.t().mm(block.Edges(edges));
      block.Points(to_own).copy_(of_sums.view({block.points, m, h}).sum(1));
      block.Edges(to_sums).copy_(of_sums);
    });

    // Gradient from the edges that read each point. Looped by point, so that no two threads write the same row.
    const Tensor to_other = torch::zeros_like(other);
    const float* from = to_sums.const_data_ptr<float>();
    const int64_t* edge = incoming.const_data_ptr<int64_t>();
    const int64_t* begin = incoming_begin.const_data_ptr<int64_t>();
    float* to = to_other.data_ptr<float>();
    at::parallel_for(0, other.size(0), 512, [&](int64_t first, int64_t last) {
      for (int64_t j = first; j < last; ++j) {
        for (int64_t e = begin[j]; e < begin[j + 1]; ++e) {
          const float* row = from + edge[e] * h;
          for (int64_t c = 0; c < h; ++c) to[j * h + c] += row[c];
        }
      }
    });
    const auto sum = [](const std::vector<Tensor>& parts) {
      const Tensor total = parts[0].clone();
      for (size_t b = 1; b < parts.size(); ++b) total.add_(parts[b]);
      return total;
    };
    return {to_own,
            to_other,
            Tensor(),
            Tensor(),
            Tensor(),
            Tensor(),
            Tensor(),
            sum(to_edge_weight),
            sum(to_message_weight),
            sum(to_bias)};
  }
};

}  // namespace

EdgeIndex MakeEdgeIndex(const Tensor& index, int64_t points, int64_t others) {
  const int64_t count = index.size(0);
  EdgeIndex out;
  out.index = index.to(torch::kInt64).contiguous();
  out.neighbours = points > 0 ? count / points : 0;
  out.incoming = torch::empty({count}, torch::kInt64);
  out.incoming_begin = torch::zeros({others + 1}, torch::kInt64);
  const int64_t* far = out.index.const_data_ptr<int64_t>();
  int64_t* begin = out.incoming_begin.data_ptr<int64_t>();
  int64_t* edge = out.incoming.data_ptr<int64_t>();
  for (int64_t e = 0; e < count; ++e) ++begin[far[e] + 1];
  for (int64_t j = 0; j < others; ++j) begin[j + 1] += begin[j];
  std::vector<int64_t> next(begin, begin + others);
  for (int64_t e = 0; e < count; ++e) edge[next[static_cast<size_t>(far[e])]++] = e;
  return out;
}

Tensor PooledMessagesPlain(const Tensor& own, const Tensor& other, const Tensor& edges, const EdgeIndex& index,
                           const Tensor& edge_weight, const Tensor& message_weight, const Tensor& message_bias) {
  const int64_t n = own.size(0), h = own.size(1), m = index.neighbours;
  if (m == 0) return torch::zeros({n, 2 * h}, own.options());
  const Tensor sums =
      (edges.mm(edge_weight.t()) + other.index_select(0, index.index)).view({n, m, h}) + own.unsqueeze(1);
  const Tensor messages = torch::linear(torch::gelu(sums), message_weight, message_bias);
  return torch::cat({std::get<0>(messages.max(1)), messages.mean(1)}, 1);
}

Tensor PooledMessages(const Tensor& own, const Tensor& other, const Tensor& edges, const EdgeIndex& index,
                      const Tensor& edge_weight, const Tensor& message_weight, const Tensor& message_bias) {
  // Other devices and number types use the plain form.
  if (index.neighbours == 0 || own.device() != torch::kCPU || own.scalar_type() != torch::kFloat32) {
    return PooledMessagesPlain(own, other, edges, index, edge_weight, message_weight, message_bias);
  }
  return PooledMessagesFunction::apply(own.contiguous(), other.contiguous(), edges, index.index, index.incoming,
                                       index.incoming_begin, index.neighbours, edge_weight, message_weight,
                                       message_bias);
}

}  // namespace anchorsplat

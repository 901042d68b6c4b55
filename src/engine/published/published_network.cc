#include "published/published_network.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"
#include "kernels/attention.h"
#include "kernels/layer_norm.h"
#include "kernels/linear.h"
#include "kernels/pooling.h"
#include "kernels/sparse_convolution.h"

namespace anchorsplat {

namespace {

// Bytes of hidden activations of MLPs and heads computed at once: they stay in the last-level cache, and memory does
// not grow with the cloud.
constexpr int64_t kHiddenBytes = int64_t{8} << 20;

int64_t ChunkRows(int64_t hidden) { return std::max<int64_t>(256, kHiddenBytes / (int64_t{4} * hidden)); }

double Products(int64_t rows, const PackedWeights& w) {
  return static_cast<double>(rows) * static_cast<double>(w.inputs()) * static_cast<double>(w.outputs());
}

// Four times as fast as std::tanh; accurate enough when scaled by ε and added to a mean.
float Tanh(float x) { return 1 - 2 / (std::exp(2 * x) + 1); }

float* Sized(Buffer<float>& buffer, int64_t rows, int64_t channels) {
  const auto count = static_cast<size_t>(rows * channels);
  if (buffer.size() < count) {
    buffer = {};  // frees the old memory before allocating more
    buffer.resize(count);
  }
  return buffer.data();
}

}  // namespace

// Scratch arrays shared by all blocks, sized for the largest.
struct PublishedNetwork::Workspace {
  Buffer<float> a, b;    // [N,C]
  Buffer<float> qkv;     // [N,3C]
  Buffer<float> hidden;  // [chunk,4C]
};

// Reads tensors by name and checks that values are finite.
class PublishedNetwork::Loader {
 public:
  Loader(const PublishedConfig& config, const WeightSource& source, WeightPrecision precision)
      : source_(source), precision_(precision) {
    for (TensorSpec& tensor : PublishedTensors(config)) tensors_.emplace(tensor.name, std::move(tensor));
  }

  // Empty after the first error, which is kept in `status`.
  Buffer<float> Values(const std::string& name) {
    const TensorSpec& tensor = tensors_.at(name);
    int64_t count = 1;
    for (const int64_t d : tensor.shape) count *= d;
    Buffer<float> values(static_cast<size_t>(count));
    if (status.ok()) status = source_(tensor, values);
    if (status.ok()) {
      const auto bad = std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
      if (bad != values.end()) {
        status = Error{ErrorCode::kBadFile, Cat("tensor \"", name, "\" holds ", std::isnan(*bad) ? "NaN" : "infinity",
                                                " at element ", bad - values.begin(), ": these weights are broken")};
      }
    }
    if (!status.ok()) values.assign(values.size(), 0.0f);
    return values;
  }

  PublishedNetwork::Norm LayerNorm(const std::string& name) {
    return {Values(name + ".weight"), Values(name + ".bias")};
  }

  // BatchNorm with running statistics, as scale and shift.
  PublishedNetwork::Norm BatchNorm(const std::string& name) {
    Norm norm = LayerNorm(name);
    const Buffer<float> mean = Values(name + ".running_mean"), variance = Values(name + ".running_var");
    for (size_t c = 0; c < mean.size(); ++c) {
      const double scale = norm.weight[c] / std::sqrt(double{variance[c]} + kBatchNormEpsilon);
      norm.bias[c] = static_cast<float>(norm.bias[c] - mean[c] * scale);
      norm.weight[c] = static_cast<float>(scale);
      if (status.ok() && !(std::isfinite(norm.weight[c]) && std::isfinite(norm.bias[c]))) {
        status = Error{ErrorCode::kBadFile, Cat("tensor \"", name, ".running_var\" holds ", variance[c], " at element ",
                                                c, ": a variance cannot be negative")};
      }
    }
    return norm;
  }

  PackedWeights Linear(const std::string& name) {
    const TensorSpec& tensor = tensors_.at(name + ".weight");
    const Buffer<float> weight = Values(name + ".weight"), bias = Values(name + ".bias");
    const int64_t taps = tensor.shape.size() == 5 ? kNeighbours : 1;
    return PackedWeights(weight.data(), bias.data(), tensor.shape[0], tensor.shape.back(), taps, precision_);
  }

  // A linear layer fused with the BatchNorm that follows it.
  PackedWeights LinearThenNorm(const std::string& name, const std::string& norm_name) {
    const TensorSpec& tensor = tensors_.at(name + ".weight");
    const Norm norm = BatchNorm(norm_name);
    Buffer<float> weight = Values(name + ".weight"), bias = Values(name + ".bias");
    const auto inputs = static_cast<size_t>(tensor.shape[1]);
    for (size_t row = 0; row < bias.size(); ++row) {
      for (size_t k = 0; k < inputs; ++k) weight[row * inputs + k] *= norm.weight[row];
      bias[row] = bias[row] * norm.weight[row] + norm.bias[row];
    }
    return PackedWeights(weight.data(), bias.data(), tensor.shape[0], tensor.shape[1]);
  }

  PublishedNetwork::Block Block(const std::string& name, int64_t heads) {
    return {.heads = heads,
            .conv = Linear(name + ".cpe.0"),
            .cpe_linear = Linear(name + ".cpe.1"),
            .qkv = Linear(name + ".attn.qkv"),
            .proj = Linear(name + ".attn.proj"),
            .fc1 = Linear(name + ".mlp.0.fc1"),
            .fc2 = Linear(name + ".mlp.0.fc2"),
            .cpe_norm = LayerNorm(name + ".cpe.2"),
            .norm1 = LayerNorm(name + ".norm1.0"),
            .norm2 = LayerNorm(name + ".norm2.0")};
  }

  // A head's last layer, with the copies' embeddings in its bias.
  PackedWeights LastOfHead(const std::string& name, const std::string& embedding_name) {
    const TensorSpec& tensor = tensors_.at(name + ".weight");
    const Buffer<float> weight = Values(name + ".weight"), embedding = Values(embedding_name);
    Buffer<float> bias = Values(name + ".bias");
    for (size_t i = 0; i < bias.size(); ++i) bias[i] += embedding[i];
    return PackedWeights(weight.data(), bias.data(), tensor.shape[0], tensor.shape[1]);
  }

  Status status;

 private:
  const WeightSource& source_;
  const WeightPrecision precision_;
  std::map<std::string, TensorSpec> tensors_;
};

Result<PublishedNetwork> PublishedNetwork::Load(const PublishedConfig& config, const WeightSource& source,
                                                WeightPrecision precision) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(config));
  PublishedNetwork network;
  network.config_ = config;
  network.precision_ = precision;
  Loader load(config, source, precision);
  const std::string backbone = "backbone.backbone.";
  network.embedding_ = load.LinearThenNorm(backbone + "embedding.0", backbone + "embedding.1");
  for (size_t s = 0; s < config.encoder_channels.size(); ++s) {
    const std::string name = Cat(backbone, "enc.enc", s);
    Stage stage;
    if (s > 0) {
      stage.down = load.Linear(name + ".down.proj");
      stage.down_norm = load.BatchNorm(name + ".down.norm.0");
    }
    for (int64_t i = 0; i < config.encoder_blocks[s]; ++i) {
      stage.blocks.push_back(load.Block(Cat(name, ".block", i), config.encoder_heads[s]));
    }
    network.encoder_.push_back(std::move(stage));
  }
  for (size_t s = 0; s < config.decoder_channels.size(); ++s) {
    const std::string name = Cat(backbone, "dec.dec", s);
    Stage stage;
    stage.up = load.LinearThenNorm(name + ".up.proj.0", name + ".up.proj.1");
    stage.up_skip = load.LinearThenNorm(name + ".up.proj_skip.0", name + ".up.proj_skip.1");
    for (int64_t i = 0; i < config.decoder_blocks[s]; ++i) {
      stage.blocks.push_back(load.Block(Cat(name, ".block", i), config.decoder_heads[s]));
    }
    network.decoder_.push_back(std::move(stage));
  }
  Buffer<float> first_weight, first_bias;
  for (const Attribute& attribute : kAttributes) {
    const std::string name = Cat("features_outputhead.", attribute.name, ".");
    const Buffer<float> weight = load.Values(name + "0.weight"), bias = load.Values(name + "0.bias");
    first_weight.insert(first_weight.end(), weight.begin(), weight.end());
    first_bias.insert(first_bias.end(), bias.begin(), bias.end());
    network.heads_.push_back({load.Linear(name + "2"), load.Linear(name + "4"),
                              load.LastOfHead(name + "6", Cat("point_embeddings.", attribute.name))});
  }
  network.head_first_ = PackedWeights(first_weight.data(), first_bias.data(), static_cast<int64_t>(first_bias.size()),
                                      static_cast<int64_t>(first_weight.size() / first_bias.size()), 1, precision);
  if (!load.status.ok()) return load.status.error();
  return network;
}

void PublishedNetwork::RunBlock(const Block& block, const Level& level, int slot, const float* conv_in, float* x,
                                Rounding rounding, Workspace& workspace, NetworkProfile* profile) const {
  const int64_t n = level.count, channels = block.proj.outputs();
  float* a = Sized(workspace.a, n, channels);
  float* b = Sized(workspace.b, n, channels);
  const auto norm = [&](const Norm& weights, const float* input, const float* add, float* out) {
    ProfileScope scope(profile, NetworkStep::kNorm);
    LayerNormCpu({.rows = n,
                  .channels = channels,
                  .input = input,
                  .weight = weights.weight.data(),
                  .bias = weights.bias.data(),
                  .epsilon = static_cast<float>(kLayerNormEpsilon),
                  .add = add,
                  .out = out});
  };

  {
    ProfileScope scope(profile, NetworkStep::kConvolution, Products(level.neighbour_pairs, block.conv));
    SparseConvolutionCpu(
        {.count = n, .input = conv_in, .neighbours = level.neighbours.data(), .weights = &block.conv, .out = a});
  }
  {
    ProfileScope scope(profile, NetworkStep::kLinear, Products(n, block.cpe_linear));
    LinearCpu(n, a, block.cpe_linear, b);
  }
  norm(block.cpe_norm, b, x, x);

  norm(block.norm1, x, nullptr, a);
  float* qkv = Sized(workspace.qkv, n, 3 * channels);
  {
    ProfileScope scope(profile, NetworkStep::kLinear, Products(n, block.qkv));
    LinearCpu(n, a, block.qkv, qkv);
  }
  {
    const auto& rows = level.patch_rows[static_cast<size_t>(slot)];
    const int64_t keys = std::min<int64_t>(config_.patch_size, static_cast<int64_t>(rows.size()));
    ProfileScope scope(profile, NetworkStep::kAttention,
                       2.0 * static_cast<double>(rows.size()) * static_cast<double>(keys * channels));
    AttentionCpu({.count = n,
                  .channels = channels,
                  .heads = block.heads,
                  .scale = static_cast<float>(1 / std::sqrt(static_cast<double>(channels / block.heads))),
                  .qkv = qkv,
                  .patch_rows = rows.data(),
                  .patch_size = config_.patch_size,
                  .rounding = rounding,
                  .out = a});
  }
  {
    ProfileScope scope(profile, NetworkStep::kLinear, Products(n, block.proj));
    LinearCpu(n, a, block.proj, x, Activation::kNone, x);
  }

  norm(block.norm2, x, nullptr, a);
  ProfileScope scope(profile, NetworkStep::kMlp, Products(n, block.fc1) + Products(n, block.fc2));
  const int64_t chunk = std::min(n, ChunkRows(block.fc1.outputs()));
  float* hidden = Sized(workspace.hidden, chunk, block.fc1.outputs());
  for (int64_t begin = 0; begin < n; begin += chunk) {
    const int64_t rows = std::min(chunk, n - begin);
    LinearCpu(rows, a + begin * channels, block.fc1, hidden, Activation::kGelu);
    LinearCpu(rows, hidden, block.fc2, x + begin * channels, Activation::kNone, x + begin * channels);
  }
}

Buffer<float> PublishedNetwork::Context(const float* features, std::span<const Level> levels, Rounding rounding,
                                        NetworkProfile* profile) const {
  if (rounding == Rounding::kNone && precision_ == WeightPrecision::kBFloat16) rounding = Rounding::kBFloat16;
  Workspace workspace;
  const auto run_blocks = [&](const Stage& stage, const Level& level, const float* first_conv_in, Buffer<float>& x) {
    for (size_t i = 0; i < stage.blocks.size(); ++i) {
      const float* conv_in = i == 0 && first_conv_in != nullptr ? first_conv_in : x.data();
      RunBlock(stage.blocks[i], level, static_cast<int>(i % kCurves), conv_in, x.data(), rounding, workspace, profile);
    }
  };
  const auto linear = [&](int64_t rows, const float* input, const PackedWeights& weights, Activation activation) {
    ProfileScope scope(profile, NetworkStep::kLinear, Products(rows, weights));
    Buffer<float> out(static_cast<size_t>(rows * weights.outputs()));
    LinearCpu(rows, input, weights, out.data(), activation);
    return out;
  };

  Buffer<float> x = linear(levels[0].count, features, embedding_, Activation::kGelu);
  std::vector<Buffer<float>> skips;
  for (size_t s = 0; s < encoder_.size(); ++s) {
    const Stage& stage = encoder_[s];
    if (s > 0) {
      const Level& fine = levels[s - 1];
      const Buffer<float> projected = linear(fine.count, x.data(), stage.down, Activation::kNone);
      skips.push_back(std::move(x));
      ProfileScope scope(profile, NetworkStep::kPooling);
      x = Buffer<float>(static_cast<size_t>(levels[s].count * stage.down.outputs()));
      ClusterMaxCpu({.fine_count = fine.count,
                     .coarse_count = levels[s].count,
                     .channels = stage.down.outputs(),
                     .input = projected.data(),
                     .cluster = fine.cluster.data(),
                     .scale = stage.down_norm.weight.data(),
                     .shift = stage.down_norm.bias.data(),
                     .out = x.data()});
    }
    run_blocks(stage, levels[s], nullptr, x);
  }
  for (size_t s = decoder_.size(); s-- > 0;) {
    const Stage& stage = decoder_[s];
    const Buffer<float> up = linear(levels[s + 1].count, x.data(), stage.up, Activation::kGelu);
    const Buffer<float> skip = linear(levels[s].count, skips[s].data(), stage.up_skip, Activation::kGelu);
    skips.pop_back();
    {
      ProfileScope scope(profile, NetworkStep::kPooling);
      x = Buffer<float>(skip.size());
      ClusterAddCpu({.fine_count = levels[s].count,
                     .channels = stage.up.outputs(),
                     .skip = skip.data(),
                     .coarse = up.data(),
                     .cluster = levels[s].cluster.data(),
                     .out = x.data()});
    }
    // The first block's convolution reads the skip branch alone, as in the release the weights were trained with (see
    // SerializedUnpooling).
    run_blocks(stage, levels[s], skip.data(), x);
  }
  return x;
}

void PublishedNetwork::Gaussians(const float* context, const float* features, int64_t n, float* out,
                                 NetworkProfile* profile) const {
  const int64_t width = config_.context_channels(), copies = config_.copies, hidden = config_.head_hidden;
  const int64_t all_hidden = head_first_.outputs();
  const int64_t widest = copies * kAttributes[5].channels;
  const int64_t chunk = std::min(n, ChunkRows(all_hidden + 2 * hidden + widest));
  Buffer<float> input(static_cast<size_t>(chunk * (width + kFeatures))), first(static_cast<size_t>(chunk * all_hidden)),
      second(static_cast<size_t>(chunk * hidden)), third(static_cast<size_t>(chunk * hidden)),
      last(static_cast<size_t>(chunk * widest));
  double products = Products(n, head_first_);
  for (const Head& head : heads_)
    products += Products(n, head.second) + Products(n, head.third) + Products(n, head.last);
  ProfileScope scope(profile, NetworkStep::kHeads, products);

  for (int64_t begin = 0; begin < n; begin += chunk) {
    const int64_t rows = std::min(chunk, n - begin);
    for (int64_t i = 0; i < rows; ++i) {
      float* row = input.data() + i * (width + kFeatures);
      std::copy_n(context + (begin + i) * width, width, row);
      std::copy_n(features + (begin + i) * kFeatures, kFeatures, row + width);
    }
    LinearCpu(rows, input.data(), head_first_, first.data(), Activation::kRelu);
    for (size_t a = 0; a < heads_.size(); ++a) {
      LinearCpu({.rows = rows,
                 .input = first.data() + static_cast<int64_t>(a) * hidden,
                 .input_stride = all_hidden,
                 .weights = &heads_[a].second,
                 .activation = Activation::kRelu,
                 .out = second.data(),
                 .output_stride = hidden});
      LinearCpu(rows, second.data(), heads_[a].third, third.data(), Activation::kRelu);
      LinearCpu(rows, third.data(), heads_[a].last, last.data());
      const int64_t channels = kAttributes[a].channels, offset = kAttributes[a].offset;
      ParallelFor(0, rows, 64, [&](int64_t first_row, int64_t last_row) {
        for (int64_t i = first_row; i < last_row; ++i) {
          const float* anchor = features + (begin + i) * kFeatures + offset;
          for (int64_t k = 0; k < copies; ++k) {
            const float* delta = last.data() + (i * copies + k) * channels;
            float* gaussian = out + (k * n + begin + i) * kFeatures + offset;
            for (int64_t c = 0; c < channels; ++c) {
              gaussian[c] = anchor[c] + (a == 0 ? kAnchorOffsetScale * Tanh(delta[c]) : delta[c]);
            }
          }
        }
      });
    }
  }
}

int64_t PublishedNetwork::bytes() const {
  const auto size = [](const PackedWeights& w) {
    const int64_t row = w.precision() == WeightPrecision::kFloat ? 4 * w.inputs() : 4 * w.pairs();
    return w.taps() * w.panels() * PackedWeights::kPanel * row;
  };
  int64_t sum = size(embedding_) + size(head_first_);
  for (const auto* stages : {&encoder_, &decoder_}) {
    for (const Stage& stage : *stages) {
      sum += size(stage.down) + size(stage.up) + size(stage.up_skip);
      for (const Block& b : stage.blocks) {
        sum += size(b.conv) + size(b.cpe_linear) + size(b.qkv) + size(b.proj) + size(b.fc1) + size(b.fc2);
      }
    }
  }
  for (const Head& head : heads_) sum += size(head.second) + size(head.third) + size(head.last);
  return sum;
}

}  // namespace anchorsplat

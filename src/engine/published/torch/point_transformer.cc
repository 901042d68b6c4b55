#include "published/torch/point_transformer.h"

#include <numeric>

#include "core/text.h"
#include "kernels/serialization.h"
#include "network/torch/group.h"

namespace anchorsplat {

namespace {

// `count` rates rising linearly from 0 to `last`.
std::vector<double> DropPathRates(double last, int64_t count) {
  std::vector<double> rates(static_cast<size_t>(count));
  for (size_t i = 0; i < rates.size(); ++i) {
    rates[i] = count > 1 ? last * static_cast<double>(i) / static_cast<double>(count - 1) : 0;
  }
  return rates;
}

}  // namespace

PointTransformerV3Impl::PointTransformerV3Impl(const PublishedConfig& config)
    : embedding(kFeatures, config.encoder_channels[0]), embedding_norm(PointBatchNorm(config.encoder_channels[0])) {
  register_module("embedding", torch::nn::ModuleList(embedding, embedding_norm));

  const auto total = [](const std::vector<int64_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), int64_t{0});
  };
  const size_t stages = config.encoder_channels.size();
  const std::vector<double> encoder_rates = DropPathRates(config.drop_path, total(config.encoder_blocks));
  Group enc = register_module("enc", Group());
  size_t block_index = 0;
  for (size_t s = 0; s < stages; ++s) {
    Group group = enc->register_module(Cat("enc", s), Group());
    Stage stage;
    const int64_t channels = config.encoder_channels[s];
    if (s > 0) {
      stage.down = group->register_module("down", SerializedPooling(config.encoder_channels[s - 1], channels));
    }
    for (int64_t i = 0; i < config.encoder_blocks[s]; ++i) {
      stage.blocks.push_back(group->register_module(
          Cat("block", i), Block(channels, config.encoder_heads[s], encoder_rates[block_index++])));
    }
    encoder.push_back(std::move(stage));
  }

  // Decoder rates are assigned to stages finest first, and fall within each stage.
  const std::vector<double> decoder_rates = DropPathRates(config.drop_path, total(config.decoder_blocks));
  Group dec = register_module("dec", Group());
  decoder.resize(stages - 1);
  for (size_t s = stages - 1; s-- > 0;) {
    Group group = dec->register_module(Cat("dec", s), Group());
    Stage& stage = decoder[s];
    const int64_t channels = config.decoder_channels[s];
    const int64_t coarse = s + 2 == stages ? config.encoder_channels[s + 1] : config.decoder_channels[s + 1];
    stage.up = group->register_module("up", SerializedUnpooling(coarse, config.encoder_channels[s], channels));
    const int64_t before = std::accumulate(config.decoder_blocks.begin(),
                                           config.decoder_blocks.begin() + static_cast<std::ptrdiff_t>(s), int64_t{0});
    for (int64_t i = 0; i < config.decoder_blocks[s]; ++i) {
      const double rate = decoder_rates[static_cast<size_t>(before + config.decoder_blocks[s] - 1 - i)];
      stage.blocks.push_back(group->register_module(Cat("block", i), Block(channels, config.decoder_heads[s], rate)));
    }
  }
}

torch::Tensor PointTransformerV3Impl::forward(const torch::Tensor& features, const Hierarchy& hierarchy,
                                              const ForwardOptions& options) {
  torch::Tensor x = torch::gelu(embedding_norm(embedding(features)));
  options.Tap("embedding", x);

  std::vector<torch::Tensor> skips;
  for (size_t s = 0; s < encoder.size(); ++s) {
    if (s > 0) {
      skips.push_back(x);
      x = encoder[s].down(x, hierarchy[s - 1], hierarchy[s].count);
    }
    for (size_t i = 0; i < encoder[s].blocks.size(); ++i) {
      x = encoder[s].blocks[i](x, x, hierarchy[s], static_cast<int>(i % kCurves), options, Cat("enc", s, ".block", i));
    }
    options.Tap(Cat("enc", s), x);
  }
  for (size_t s = decoder.size(); s-- > 0;) {
    const auto up = decoder[s].up(x, skips[s], hierarchy[s]);
    skips.pop_back();
    x = up.sum;
    for (size_t i = 0; i < decoder[s].blocks.size(); ++i) {
      x = decoder[s].blocks[i](x, i == 0 ? up.skip : x, hierarchy[s], static_cast<int>(i % kCurves), options,
                               Cat("dec", s, ".block", i));
    }
    options.Tap(Cat("dec", s), x);
  }
  return x;
}

}  // namespace anchorsplat

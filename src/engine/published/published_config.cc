#include "published/published_config.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

const std::string kBackbone = "backbone.backbone.";

// Lists tensors with name prefixes, in PyTorch's order of a module's state.
class Listing {
 public:
  void Linear(const std::string& name, int64_t out, int64_t in) { WeightAndBias(name, {out, in}); }
  void Norm(const std::string& name, int64_t channels) { WeightAndBias(name, {channels}); }
  void BatchNorm(const std::string& name, int64_t channels) {
    Norm(name, channels);
    Add(name + ".running_mean", {channels});
    Add(name + ".running_var", {channels});
    tensors.push_back({name + ".num_batches_tracked", {}, true});
  }
  void Block(const std::string& name, int64_t channels) {
    WeightAndBias(name + ".cpe.0", {channels, 3, 3, 3, channels});
    Linear(name + ".cpe.1", channels, channels);
    Norm(name + ".cpe.2", channels);
    Norm(name + ".norm1.0", channels);
    Linear(name + ".attn.qkv", 3 * channels, channels);
    Linear(name + ".attn.proj", channels, channels);
    Norm(name + ".norm2.0", channels);
    Linear(name + ".mlp.0.fc1", 4 * channels, channels);
    Linear(name + ".mlp.0.fc2", channels, 4 * channels);
  }
  void Add(const std::string& name, std::vector<int64_t> shape) { tensors.push_back({name, std::move(shape), false}); }

  std::vector<TensorSpec> tensors;

 private:
  void WeightAndBias(const std::string& name, std::vector<int64_t> shape) {
    const int64_t out = shape[0];
    Add(name + ".weight", std::move(shape));
    Add(name + ".bias", {out});
  }
};

Error BadCheckpoint(std::string message) { return Error{ErrorCode::kBadFile, std::move(message)}; }

}  // namespace

Status Validate(const PublishedConfig& config) {
  const size_t stages = config.encoder_channels.size();
  if (stages < 1 || stages > kShuffles || config.encoder_blocks.size() != stages ||
      config.encoder_heads.size() != stages || config.decoder_channels.size() + 1 != stages ||
      config.decoder_blocks.size() + 1 != stages || config.decoder_heads.size() + 1 != stages ||
      config.strides.size() + 1 != stages) {
    return Error{ErrorCode::kBadArgument, Cat("a network needs 1 to ", kShuffles,
                                              " stages with widths, blocks and heads for each encoder stage and one "
                                              "fewer decoder stages and strides")};
  }
  const auto check = [](const std::vector<int64_t>& channels, const std::vector<int64_t>& heads) {
    for (size_t s = 0; s < channels.size(); ++s) {
      if (channels[s] < 1 || heads[s] < 1 || channels[s] % heads[s] != 0) return false;
    }
    return true;
  };
  if (config.copies < 1 || config.head_hidden < 1 || config.patch_size < 1 ||
      !check(config.encoder_channels, config.encoder_heads) || !check(config.decoder_channels, config.decoder_heads)) {
    return Error{ErrorCode::kBadArgument,
                 "widths, heads, K and patch size must be positive and each stage's heads must divide its width"};
  }
  return {};
}

std::vector<TensorSpec> PublishedTensors(const PublishedConfig& config) {
  Listing list;
  const auto& enc = config.encoder_channels;
  const auto& dec = config.decoder_channels;
  list.Linear(kBackbone + "embedding.0", enc[0], kFeatures);
  list.BatchNorm(kBackbone + "embedding.1", enc[0]);
  for (size_t s = 0; s < enc.size(); ++s) {
    const std::string stage = Cat(kBackbone, "enc.enc", s);
    if (s > 0) {
      list.Linear(stage + ".down.proj", enc[s], enc[s - 1]);
      list.BatchNorm(stage + ".down.norm.0", enc[s]);
    }
    for (int64_t i = 0; i < config.encoder_blocks[s]; ++i) list.Block(Cat(stage, ".block", i), enc[s]);
  }
  for (size_t s = dec.size(); s-- > 0;) {
    const std::string stage = Cat(kBackbone, "dec.dec", s);
    list.Linear(stage + ".up.proj.0", dec[s], s + 1 == dec.size() ? enc[s + 1] : dec[s + 1]);
    list.BatchNorm(stage + ".up.proj.1", dec[s]);
    list.Linear(stage + ".up.proj_skip.0", dec[s], enc[s]);
    list.BatchNorm(stage + ".up.proj_skip.1", dec[s]);
    for (int64_t i = 0; i < config.decoder_blocks[s]; ++i) list.Block(Cat(stage, ".block", i), dec[s]);
  }
  for (const Attribute& a : kAttributes) {
    const std::string head = Cat("features_outputhead.", a.name, ".");
    const int64_t hidden = config.head_hidden;
    list.Linear(head + "0", hidden, config.context_channels() + kFeatures);
    list.Linear(head + "2", hidden, hidden);
    list.Linear(head + "4", hidden, hidden);
    list.Linear(head + "6", config.copies * a.channels, hidden);
  }
  for (const Attribute& a : kAttributes) list.Add(Cat("point_embeddings.", a.name), {config.copies, a.channels});
  return std::move(list.tensors);
}

Result<PublishedConfig> ConfigOfTensors(std::span<const TensorSpec> tensors) {
  std::map<std::string, const TensorSpec*> by_name;
  for (const TensorSpec& tensor : tensors) by_name[tensor.name] = &tensor;
  // Dimension 0 of a tensor with that many dimensions; 0 if there is none.
  const auto rows = [&](const std::string& name, size_t dimensions) -> int64_t {
    const auto found = by_name.find(name);
    return found != by_name.end() && found->second->shape.size() == dimensions ? found->second->shape[0] : 0;
  };
  const auto require = [&](const std::string& name, size_t dimensions) -> Result<int64_t> {
    const int64_t length = rows(name, dimensions);
    if (length > 0) return length;
    const auto found = by_name.find(name);
    return BadCheckpoint(found == by_name.end()
                             ? Cat("no tensor \"", name, "\": not a checkpoint of AnchorSplat")
                             : Cat("tensor \"", name, "\" has the shape ", ShapeText(found->second->shape), ", but ",
                                   dimensions, " non-empty dimensions were expected"));
  };

  PublishedConfig config;  // heads and strides stay as published
  ANCHORSPLAT_ASSIGN_OR_RETURN(config.copies, require("point_embeddings.means", 2));
  ANCHORSPLAT_ASSIGN_OR_RETURN(config.head_hidden, require("features_outputhead.means.0.weight", 2));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t first, require(kBackbone + "embedding.0.weight", 2));
  config.encoder_channels = {first};
  for (int64_t s = 1; s < kShuffles; ++s) {
    const int64_t channels = rows(Cat(kBackbone, "enc.enc", s, ".down.proj.weight"), 2);
    if (channels == 0) break;
    config.encoder_channels.push_back(channels);
  }
  const size_t stages = config.encoder_channels.size();
  const auto blocks = [&](const std::string& stage) {
    int64_t count = 0;
    while (by_name.contains(Cat(stage, ".block", count, ".norm1.0.weight"))) ++count;
    return count;
  };
  config.encoder_blocks.clear();
  config.decoder_blocks.clear();
  config.decoder_channels.clear();
  for (size_t s = 0; s < stages; ++s) config.encoder_blocks.push_back(blocks(Cat(kBackbone, "enc.enc", s)));
  for (size_t s = 0; s + 1 < stages; ++s) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t channels, require(Cat(kBackbone, "dec.dec", s, ".up.proj.0.weight"), 2));
    config.decoder_channels.push_back(channels);
    config.decoder_blocks.push_back(blocks(Cat(kBackbone, "dec.dec", s)));
  }
  config.encoder_heads.resize(stages);
  config.decoder_heads.resize(stages - 1);
  config.strides.resize(stages - 1);
  if (!Validate(config).ok()) {
    for (size_t s = 0; s < stages; ++s) {
      if (config.encoder_channels[s] % config.encoder_heads[s] != 0) {
        return BadCheckpoint(Cat("encoder stage ", s, " is ", config.encoder_channels[s], " channels wide, which its ",
                                 config.encoder_heads[s], " heads do not divide"));
      }
    }
    return BadCheckpoint("the widths of the decoder stages are no multiples of their heads (4, 4, 8, 16)");
  }
  return config;
}

Buffer<int32_t> GridVoxels(const float* features, int64_t count, int64_t stride) {
  Buffer<int32_t> voxels(static_cast<size_t>(3 * count));
  ParallelFor(0, count, 8192, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      for (int64_t axis = 0; axis < 3; ++axis) {
        // A coordinate of exactly 1 gives 384.
        const float scaled = features[i * stride + axis] * static_cast<float>(kGridResolution);
        voxels[static_cast<size_t>(3 * i + axis)] = static_cast<int32_t>(std::floor(scaled));
      }
    }
  });
  return voxels;
}

HierarchyOptions HierarchyOptionsFor(const PublishedConfig& config, const Shuffles& shuffles, DepthRule depth_rule) {
  return {.strides = config.strides, .patch_size = config.patch_size, .depth_rule = depth_rule, .shuffles = shuffles};
}

}  // namespace anchorsplat

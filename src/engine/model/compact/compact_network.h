#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "model/compact/compact_blocks.h"
#include "model/compact/compact_config.h"
#include "model/compact/compact_features.h"
#include "model/compact/compact_output.h"
#include "model/compact/compact_residual.h"
#include "model/kernels/packed_weights.h"
#include "model/shared/weights.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// States of so many and of those around them stay in the caches of most machines.
inline constexpr int64_t kCompactBlock = 65'536;

class CompactNetwork;

// What a compact network is asked for.
struct CompactTask {
  std::span<const float> pixel_sizes;  // p_LR, world units, one for all or one per Gaussian
  double upscale = 4;                  // u ≥ 1
  double strength = 0;                 // f of the filter that residuals are added to, > 0
  // Gaussians whose states are kept at a time, besides those that they hear from; > 0. Changes no bit of the result.
  int64_t block_gaussians = kCompactBlock;
  // Which copies live; nothing: all of them.
  std::optional<CopyChoice> choice = std::nullopt;
  // Gaussians of which one copy stays where costs choose, ascending.
  std::span<const int64_t> single = {};
  // Makes one Gaussian of one, which may stand in for all the copies where costs choose and no number of copies is
  // given; of the same neighbours, rounds, context and features as the network itself. Nothing: none does.
  const CompactNetwork* stand_in = nullptr;
  // 0: a Gaussian that others hear from and of which nothing comes out; one per Gaussian, empty: none.
  std::span<const char> inside = {};
  // Where what the blocks have made is kept, for a run that ends before its end; empty: nowhere.
  std::filesystem::path checkpoint = {};
  bool resume = false;  // go on from `checkpoint` if it is there
};

struct CompactResult {
  // Copy k of all anchors before copy k + 1, then stand-ins and those that stayed alone; the input's metadata.
  GaussianCloud cloud;
  int64_t outside = 0;     // Gaussians unlike the training data: filtered, and nothing else
  int64_t partly = 0;      // Gaussians somewhat unlike it: a part of the residual
  int64_t not_finite = 0;  // Gaussians for which the network says something that is not finite: its start
  int64_t made = 0;        // Gaussians before the choice among copies
  int64_t resumed = 0;     // blocks that a checkpoint brought
  ChosenCopies chosen;
  struct {
    double neighbours = 0, network = 0, copies = 0, order = 0;  // seconds
  } times;
};

// A compact network for inference on the CPU, as a row of kernel calls on raw arrays. The torch module in torch/
// is the same network for training; a test holds the two together.
//
// Where the network comes from knows the range of every feature of the Gaussians it was trained on. A Gaussian outside
// of it keeps a part of the residual that falls from 1 to 0 with its distance (kFadeBegin to kFadeEnd, in feature units
// of model/compact/compact_features.h; widths count as they are, beyond the bounds of their features too); at 0 it is
// what the filter makes of it, one Gaussian.
//
// A network that makes several copies says less of Gaussians whose middle axis measures more than kLarge pixels, too,
// and nothing from kVeryLarge on: pixels hid nothing of these, and copies whose centres lie far apart may come before
// or behind others than one did, and show what it hid.
class CompactNetwork {
 public:
  // Errors: of Validate(config) and of `source`; kBadFile naming the tensor when a weight is NaN or infinite.
  static Result<CompactNetwork> Load(const CompactConfig& config, const WeightSource& source);

  const CompactConfig& config() const { return config_; }
  // False when the range of a feature in training is not known, so that nothing lies outside of it.
  bool KnowsItsDomain() const;
  // The least and the greatest upscale it was trained for; least above greatest: not known.
  std::pair<double, double> TrainedUpscales() const;

  // Enhances a cloud of finite values (log-scales and opacity logits may be −Inf). The same bits for any number of
  // threads. Needs about 1.5 KB per Gaussian of a block, and 150 bytes of Buffers per Gaussian of the cloud, besides
  // the cloud, which is given back before the result is put in order, and twice the result. Errors (kBadArgument): of
  // Validate(cloud) and Validate(choice); no Gaussians or 2^31 rows; a wrong number of pixel sizes, one that is not
  // positive and finite; upscale below 1; a strength that is negative; a stand-in of another shape; more output than
  // memory holds. Of the checkpoint: those of CompactCheckpoint. kInterrupted: the user stopped it; the checkpoint
  // stays.
  Result<CompactResult> Apply(GaussianCloud cloud, const CompactTask& task) const;

  // The raw outputs [N, CompactOutputs(config())] for the features of a cloud, before bounds and fading.
  void Outputs(const CompactFeatures& features, const CompactGraph& graph, float* out) const;

 private:
  struct Norm {
    Buffer<float> weight, bias;
  };
  struct Round {
    PackedWeights own, other, edge, message, update_first, update_second;
    Norm norm;
  };
  class Loader;

  // Of a block's Gaussians, [rows,H]; its memory serves one block after the other.
  struct States {
    Buffer<float> own;     // of the block's own Gaussians these are after all rounds
    Buffer<float> others;  // what others are told of them
  };
  void FindStates(const CompactFeatures& features, const CompactBlock& block, int64_t neighbours, States& states) const;
  // Of the block's own Gaussians begin to end.
  void Head(const CompactFeatures& features, const CompactBlock& block, const States& states, int64_t begin,
            int64_t end, float* out) const;
  // Writes what the network makes of a block's own Gaussians into `made`: copies where the fade is more than 0, what
  // the filter makes where it is 0, nothing where it is below. `first`: the row of the first copy of each, `stride`:
  // from one copy to the next. Returns how many it says something not finite about.
  int64_t Make(const CompactFeatures& features, const CompactAnchors& anchors, const CompactBlock& block,
               std::span<const float> fades, std::span<const int64_t> first, int64_t stride, States& states,
               GaussianCloud& made) const;
  // Of a block's own Gaussians: 1 within the range of the training data, 0 far outside.
  Buffer<float> Familiarity(const CompactFeatures& features, const CompactBlock& block) const;
  float Fade(const float* node, const std::array<float, 3>& widths) const;
  // Of the residual that a Gaussian of such widths (half logarithms, pixels) keeps.
  float ShareOfLarge(const std::array<float, 3>& widths) const;

  CompactConfig config_;
  std::string fingerprint_;  // of the configuration and all weights
  PackedWeights embed_first_, embed_second_;
  Norm embed_norm_;
  std::vector<Round> rounds_;
  PackedWeights head_first_, head_second_, out_;
  std::vector<float> low_, high_;  // of the features in training; low above high: not known, nothing is outside
};

inline constexpr float kFadeBegin = 0.25f, kFadeEnd = 0.75f;
inline constexpr float kLarge = 4, kVeryLarge = 8;

// True when the metadata of a tensor file is that of a compact network.
bool IsCompactNetwork(const TensorFile& file);

// The network of a file, fully checked. Errors (kBadFile with the file's name): of CompactConfigFromMetadata; tensors
// missing, of another shape, or that belong to nothing; values that are not finite.
Result<CompactNetwork> LoadCompactNetwork(const TensorFile& file);

}  // namespace anchorsplat

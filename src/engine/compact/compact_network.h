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

#include "compact/compact_blocks.h"
#include "compact/compact_config.h"
#include "compact/compact_features.h"
#include "compact/compact_output.h"
#include "compact/compact_residual.h"
#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "kernels/packed_weights.h"
#include "network/weights.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// Gaussians per block: its states and halo fit the caches of most machines.
inline constexpr int64_t kCompactBlock = 65'536;

class CompactNetwork;

// Input of CompactNetwork::Apply besides the cloud.
struct CompactTask {
  std::span<const float> pixel_sizes;  // p_LR, world units, one for all or one per Gaussian
  double upscale = 4;                  // u ≥ 1
  double strength = 0;                 // f of the filter under the residuals, ≥ 0
  // Gaussians processed at a time, not counting their halo; > 0. Does not change the result.
  int64_t block_gaussians = kCompactBlock;
  // How many copies stay; unset: all.
  std::optional<CopyChoice> choice = std::nullopt;
  // Ascending rows of Gaussians that keep one copy when costs decide.
  std::span<const int64_t> single = {};
  // A one-copy network whose output may replace all copies of a Gaussian, when costs decide and the number of copies is
  // not set. Must have the same neighbours, rounds, context and features. May be null.
  const CompactNetwork* stand_in = nullptr;
  // One per Gaussian; 0: serves only as a neighbour, produces no output. Empty: all produce output.
  std::span<const char> in_region = {};
  // Where finished blocks are saved for resuming; empty: nowhere.
  std::filesystem::path checkpoint = {};
  bool resume = false;  // resume from `checkpoint` if it exists
};

struct CompactResult {
  // Copy k of all anchors precedes copy k + 1; then come stand-ins and Gaussians that were not copied. Keeps metadata.
  GaussianCloud cloud;
  int64_t unlike_training = 0;         // Gaussians unlike the training data, only filtered
  int64_t partly_unlike_training = 0;  // Gaussians somewhat unlike it, with a reduced residual
  int64_t not_finite = 0;              // Gaussians with non-finite network output, left at their initial copies
  int64_t made = 0;                    // Gaussians before copies were merged
  int64_t resumed = 0;                 // blocks read from the checkpoint
  ChosenCopies chosen;
  struct {
    double neighbours = 0, network = 0, copies = 0, order = 0;  // seconds
  } times;
};

// A compact network for CPU inference, as kernel calls on raw arrays. torch/ has the same network for training; a test
// compares the two.
//
// The weights file stores the range of every feature in training. Outside that range a Gaussian's residual fades from 1
// to 0 with distance (kFadeBegin to kFadeEnd, in feature units of compact/compact_features.h; widths are measured
// without their features' bounds). At 0 the Gaussian is only filtered and not copied.
//
// With several copies, the residual also fades for Gaussians whose middle axis is longer than kLargeFadeBegin pixels,
// to 0 at kLargeFadeEnd. Pixels hid nothing of such Gaussians, and widely separated copies would change the depth order
// and show what the Gaussian hid.
class CompactNetwork {
 public:
  // Errors: of Validate(config) and of `source`; kBadFile naming the tensor when a weight is NaN or infinite.
  static Result<CompactNetwork> Load(const CompactConfig& config, const WeightSource& source);

  const CompactConfig& config() const { return config_; }
  // Whether the feature range of training is known. If not, no Gaussian counts as outside it.
  bool HasTrainingRange() const;
  // Smallest and largest upscale in training; smallest > largest if unknown.
  std::pair<double, double> TrainedUpscales() const;

  // Enhances a cloud of finite values (log-scales and opacity logits may be −Inf). The same bits for any number of
  // threads. Memory: about 1.5 KB per Gaussian of a block, 150 bytes of Buffers per Gaussian of the cloud, the cloud
  // (freed before the result is sorted) and twice the result.
  // Errors (kBadArgument): those of Validate(cloud) and Validate(choice); no Gaussians or 2^31 rows; a wrong number of
  // pixel sizes, or one not positive and finite; upscale below 1; negative strength; a stand-in of another shape;
  // output larger than memory. Those of CompactCheckpoint. kInterrupted if the user stopped it; the checkpoint stays.
  Result<CompactResult> Apply(GaussianCloud cloud, const CompactTask& task) const;

  // Raw outputs [N, CompactOutputs(config())] for a cloud's features, before bounds and fading.
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

  // States of a block's Gaussians, [rows,H]. Memory is reused across blocks.
  struct States {
    Buffer<float> own;     // final states, for the block's own Gaussians
    Buffer<float> others;  // messages to neighbours
  };
  void FindStates(const CompactFeatures& features, const CompactBlock& block, int64_t neighbours, States& states) const;
  // Raw outputs for the block's own Gaussians [begin, end).
  void Head(const CompactFeatures& features, const CompactBlock& block, const States& states, int64_t begin,
            int64_t end, float* out) const;
  // Writes a block's own Gaussians to `made`: copies where fade > 0, the filtered Gaussian where it is 0, nothing where
  // it is negative. `first`: row of each one's first copy; `stride`: rows between copies. Returns how many have
  // non-finite network output.
  int64_t Make(const CompactFeatures& features, const CompactAnchors& anchors, const CompactBlock& block,
               std::span<const float> fades, std::span<const int64_t> first, int64_t stride, States& states,
               GaussianCloud& made) const;
  // For a block's own Gaussians: 1 within the feature range of training, 0 far outside.
  Buffer<float> TrainingFade(const CompactFeatures& features, const CompactBlock& block) const;
  float Fade(const float* node, const std::array<float, 3>& widths) const;
  // Share of the residual kept at these widths (half logarithms, pixels).
  float LargeGaussianFade(const std::array<float, 3>& widths) const;

  CompactConfig config_;
  std::string fingerprint_;  // of the configuration and all weights
  PackedWeights embed_first_, embed_second_;
  Norm embed_norm_;
  std::vector<Round> rounds_;
  PackedWeights head_first_, head_second_, out_;
  std::vector<float> low_, high_;  // feature range of training; low above high: unknown, nothing is outside
};

inline constexpr float kFadeBegin = 0.25f, kFadeEnd = 0.75f;
// Width of the middle axis between which the residual fades, pixels.
inline constexpr float kLargeFadeBegin = 4, kLargeFadeEnd = 8;

// Whether a tensor file's metadata names a compact network.
bool IsCompactNetwork(const TensorFile& file);

// Loads and validates a network. Errors (kBadFile with the file's name): those of CompactConfigFromMetadata; tensors
// missing, unknown or of the wrong shape; non-finite values.
Result<CompactNetwork> LoadCompactNetwork(const TensorFile& file);

}  // namespace anchorsplat

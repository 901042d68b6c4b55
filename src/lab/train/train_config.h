#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/result.h"
#include "model/shared/torch/network_options.h"
#include "perceptual/lpips_net.h"

namespace anchorsplat {

// Weights of the loss's terms, each a mean over the pictures of a step (photometric_objective.h, perceptual_objective.h
// say what they are).
struct LossConfig {
  double l1 = 1;
  double ssim = 0;
  double mse = 0;
  double log_mse = 0;
  double lpips = 0;
  LpipsNet lpips_net = LpipsNet::kVgg;
  int lpips_crop = 192;  // pixels a side of the random part that LPIPS sees; 0: the whole picture
};

enum class Schedule { kConstant, kCosine };

struct OptimizerConfig {
  double learning_rate = 1e-3;           // of groups that are not named
  std::map<std::string, double> groups;  // by the network's group names
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  double weight_decay = 0;  // decoupled (AdamW)
  double clip = 0;          // largest norm of the whole gradient, 0: any
  Schedule schedule = Schedule::kCosine;
  int64_t warm_up = 0;  // steps of linear rise
  double final = 0.01;  // what is left of the rate at the end of a cosine
  double ema = 0.999;   // of the weights that are validated and saved; 0: the last ones
};

struct DataConfig {
  int views_per_object = 24;  // fixed random choice among those that no validation may see; 0: all of them
  int scenes_per_step = 1;    // per process
  int views_per_step = 2;     // of each scene
  int crop = 0;               // pixels a side of a random part of each view; 0: whole views
  // Most Gaussians of which a step makes copies; 0: all. Crops then show one spot from several sides, the network
  // works on the Gaussians seen there and the rest is drawn filtered.
  int64_t part = 0;
  bool fixed_views = false;  // always the first of an object's views instead of random ones
  int objects_in_memory = 64;
  // What merges of copies may cost before a step shows them, drawn for every step, evenly in the logarithm; 0: all
  // copies are shown. See merged_copies.h.
  double least_merge_cost = 0, greatest_merge_cost = 0;
  // How many times closer an object's views are, drawn by its name, evenly in the logarithm; 0: as the data set has
  // them. Others than that are made on demand.
  double least_upscale = 0, greatest_upscale = 0;
};

// How captures become pairs (dataset/capture.h).
struct CapturesConfig {
  int downscale = 4;
  int hold_out = 4;                         // every so many views train the network and not the fit
  std::vector<int64_t> fit_steps = {1000};  // of each capture's fits

  bool operator==(const CapturesConfig&) const = default;
};

// What is drawn anew each time a splat is used. Standard deviations and largest values; 0: not at all.
struct AugmentationConfig {
  bool rotate = false;          // the world, SH and cameras with it
  bool mirror = false;          // every second splat
  double scale = 0;             // σ of ln(factor) of the world, at most two σ are drawn
  bool permute_colors = false;  // red, green and blue change places
  double gain = 0;              // colours times 1 − gain to 1, each channel for itself
  double drop = 0;              // largest share of Gaussians left out
  double opacity_noise = 0;     // σ of what is added to opacity logits
  double pixel_size_noise = 0;  // σ of ln(factor) of p_LR, one factor per splat
  double strength_noise = 0;    // σ of ln(factor) of the filter's strength

  bool geometry() const { return rotate || mirror || scale > 0 || drop > 0 || opacity_noise > 0; }
};

struct ValidationConfig {
  int64_t every = 500;  // steps; 0: only at the end
  int views = 4;        // held-out views per object, evenly spread; 0: all
  int objects = 0;      // evenly spread; 0: all
  bool lpips = false;   // LPIPS (AlexNet) too, where its weights are
};

enum class Precision { kFp32, kBf16, kFp16 };

// A training as its TOML file describes it (docs/training.md).
struct TrainConfig {
  uint64_t seed = 0;
  int64_t steps = 10000;
  Precision precision = Precision::kFp32;  // autocast around the network alone
  std::string device = "cpu";              // of the network: "cpu", "cuda" or "auto"; rendering stays on the CPU
  int64_t checkpoint_every = 500;
  int64_t log_every = 10;
  std::string kind = "compact";
  NetworkOptions network;
  LossConfig loss;
  OptimizerConfig optimizer;
  DataConfig data;
  CapturesConfig captures;
  AugmentationConfig augmentation;
  ValidationConfig validation;

  std::string file;                          // for messages
  std::map<std::string, int> network_lines;  // of the options in `network`
};

// Errors: those of ReadFileBytes; kBadFile "FILE: line 12: optimizer.clip: expected …": not TOML, an unknown table or
// key, a value of a wrong type or out of its range.
Result<TrainConfig> ReadTrainConfig(const std::filesystem::path& path);
Result<TrainConfig> ParseTrainConfig(const std::string& text, const std::string& name);

// What must not change between the parts of one training, as a flat object. Steps, logging and validation may.
nlohmann::json Settings(const TrainConfig& config);

// A kBadFile error with the file and the line of the network option that its message begins with.
Error InNetworkTable(const TrainConfig& config, const Error& error);

}  // namespace anchorsplat

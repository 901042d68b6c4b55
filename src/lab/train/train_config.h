#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/result.h"
#include "network/torch/network_options.h"
#include "perceptual/lpips_net.h"

namespace anchorsplat {

// Weights of the loss terms, each a mean over a step's pictures (photometric_objective.h, perceptual_objective.h).
struct LossConfig {
  double l1 = 1;
  double ssim = 0;
  double mse = 0;
  double log_mse = 0;
  double lpips = 0;
  LpipsNet lpips_net = LpipsNet::kVgg;
  int lpips_crop = 192;  // side of the random crop for LPIPS, pixels; 0: the whole picture
};

enum class Schedule { kConstant, kCosine };

struct OptimizerConfig {
  double learning_rate = 1e-3;           // for groups not named below
  std::map<std::string, double> groups;  // by the network's group names
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  double weight_decay = 0;  // decoupled (AdamW)
  double clip = 0;          // maximum gradient norm, 0: none
  Schedule schedule = Schedule::kCosine;
  int64_t warm_up = 0;  // steps of linear increase
  double final = 0.01;  // final rate of a cosine schedule, relative
  double ema = 0.999;   // decay of the averaged weights that are validated and saved; 0: no averaging
};

struct DataConfig {
  int views_per_object = 24;  // fixed random choice among non-validation views; 0: all
  int scenes_per_step = 1;    // per process
  int views_per_step = 2;     // of each scene
  int crop = 0;               // side of a random crop of each view, pixels; 0: whole views
  // Maximum Gaussians copied by the network per step; 0: all. Crops then show one spot from several sides, the network
  // processes the Gaussians visible there, and the rest is drawn filtered.
  int64_t part = 0;
  bool fixed_views = false;  // uses an object's first views instead of random ones
  int objects_in_memory = 64;
  // Range of the maximum cost of merging copies before rendering, drawn log-uniformly per step; 0: no merging. See
  // merged_copies.h.
  double least_merge_cost = 0, greatest_merge_cost = 0;
  // Range of the upscale of an object's views, drawn log-uniformly by its name; 0: as in the data set. Other sizes are
  // rendered on demand.
  double least_upscale = 0, greatest_upscale = 0;
};

// How captures become training objects (dataset/capture.h).
struct CapturesConfig {
  int downscale = 4;
  int hold_out = 4;                         // holds out every Nth view from the fit, to train the network
  std::vector<int64_t> fit_steps = {5000};  // of each capture's fits

  bool operator==(const CapturesConfig&) const = default;
};

// Random augmentation, drawn anew whenever a splat is used. Standard deviations or maxima; 0: off.
struct AugmentationConfig {
  bool rotate = false;          // the world, with SH and cameras
  bool mirror = false;          // every second splat
  double scale = 0;             // σ of ln(factor) of the world, clamped to two σ
  bool permute_colors = false;  // permutes red, green and blue
  double gain = 0;              // multiplies colours by 1 − gain to 1, per channel
  double drop = 0;              // maximum share of Gaussians left out
  double opacity_noise = 0;     // σ added to opacity logits
  double pixel_size_noise = 0;  // σ of ln(factor) of p_LR, one factor per splat
  double strength_noise = 0;    // σ of ln(factor) of the filter's strength

  bool geometry() const { return rotate || mirror || scale > 0 || drop > 0 || opacity_noise > 0; }
};

struct ValidationConfig {
  int64_t every = 500;  // steps; 0: only at the end
  int views = 4;        // held-out views per object, evenly spread; 0: all
  int objects = 0;      // evenly spread; 0: all
  bool lpips = false;   // also LPIPS (AlexNet), if its weights are installed
};

enum class Precision { kFp32, kBf16, kFp16 };

// A training as described by its TOML file (docs/training.md).
struct TrainConfig {
  uint64_t seed = 0;
  int64_t steps = 10000;
  Precision precision = Precision::kFp32;  // autocast for the network only
  std::string device = "cpu";              // of the network: "cpu", "cuda" or "auto"; rendering is on the CPU
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
  std::map<std::string, int> network_lines;  // line of each option in `network`
};

// Errors: those of ReadFileBytes; kBadFile "FILE: line 12: optimizer.clip: expected …": no TOML, an unknown table or
// key, a value of the wrong type or range.
Result<TrainConfig> ReadTrainConfig(const std::filesystem::path& path);
Result<TrainConfig> ParseTrainConfig(const std::string& text, const std::string& name);

// Settings that must not change when a training resumes, as a flat object. Steps, logging and validation may.
nlohmann::json Settings(const TrainConfig& config);

// Prepends file and line of the network option with which the error's message begins (kBadFile).
Error InNetworkTable(const TrainConfig& config, const Error& error);

}  // namespace anchorsplat

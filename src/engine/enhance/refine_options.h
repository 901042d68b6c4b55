#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/world_origin.h"
#include "enhance/method_option.h"

namespace anchorsplat {

// Options of a refinement (enhance/refine.h). Defaults of unset ones depend on whether there are pictures, on the
// start, and on the number of Gaussians.
struct RefineOptions {
  std::filesystem::path images;  // project with the training pictures (fit/training_views.h); empty: none
  bool enlarged = false;         // the target views are u times larger (enhance/enlarged_targets.h)
  // With `enlarged`: network file (upscale/upscaler.h) that adds detail to them. Empty: they show the start's.
  std::filesystem::path enlarge_with;
  WorldOrigin origin = {0, 0, 0};  // of the splat's means, for the pictures' cameras; set by Enhance()
  // Background behind the splat and the pictures' alpha. Unset: from the cameras' file, else from the splat's comment
  // (core/splat_comments.h), else black.
  std::optional<std::array<float, 3>> background;
  // Holds out every Nth view, as in fits; 0: none. Unset: every eighth, or none if the splat matches those as well as
  // the others: then its fit was trained on them and they cannot measure improvement.
  std::optional<int> hold_out;
  int downscale = 1;  // averages pictures over squares of this side, as in fits
  std::optional<int64_t> steps;
  std::optional<double> seconds;           // time limit instead of steps; not reproducible
  std::optional<int> copies;               // K, copies per Gaussian at the start
  int64_t max_gaussians = 0;               // of the result; 0: no limit
  int poses = 128;                         // number of views without pictures and cameras
  int between = 1;                         // without pictures: poses between each camera and its neighbours
  double half_from = 0.3, all_from = 0.7;  // see PixelSchedule
  std::optional<double> rate;              // initial learning rate relative to fits …
  double rate_decay = 0.1;                 // … and its final value relative to the initial one
  double ssim_weight = 0.2;
  bool exposure = false;  // fits brightness and tint per picture
  bool robust = false;    // ignores gross differences, as of things that moved
  bool align = false;     // corrects the pictures' poses (fit/view_pose.h)
};

// How a refinement is run.
struct RefineControl {
  // Checkpoint file, never removed; empty: none. Written when the user stops the run and every `checkpoint_every`
  // steps. Not used with RefineOptions::seconds.
  std::filesystem::path checkpoint;
  int64_t checkpoint_every = 0;                // steps; 0: only when the user stops the run
  bool resume = false;                         // resume from `checkpoint` if it exists
  std::vector<std::filesystem::path> outputs;  // files the caller will write, even after an interruption
};

// Agreement of a splat with views, when rendered closer and averaged down to their resolution. SSIM is 0 for views
// smaller than its window.
struct Consistency {
  double psnr = 0;  // dB
  double ssim = 0;
};

// What a refinement will do, decided before optimising.
struct RefinePlan {
  RefineOptions options;       // with steps (unless `seconds` is set), copies and rate chosen
  bool from_input = false;     // starts from the splat as fitted instead of the given start
  bool nothing_to_do = false;  // the start already shows what the splat does, or there is no width to restore
  Consistency start;           // of the initial state
  // dB the result must gain, or else the start is kept. Above 0 for splats that may know more than the pictures show.
  double least_gain = 0;
  std::vector<int> each;  // copies per Gaussian if they differ; cleared after splitting
  int64_t gaussians = 0;  // number after splitting; 0 if a checkpoint provides them
  std::string why;        // explanation for the log; may be empty
};

inline constexpr int kMostCopies = 64;

// Every option of RefineOptions and RefineControl that users can set.
const std::vector<MethodOption>& RefinementOptions();
const std::vector<MethodOption>& CheckpointOptions();

// kBadArgument, naming the option, for values that cannot be run.
Status Validate(const RefineOptions& options);

// Increased whenever the same options give another result.
inline constexpr int kRefineRevision = 2;

// All options as one flat JSON object, 0 for unset ones; for checkpoints.
std::string ToJsonText(const RefineOptions& options);

}  // namespace anchorsplat

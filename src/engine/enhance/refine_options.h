#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "core/world_origin.h"

namespace anchorsplat {

// What a refinement does (enhance/refine.h). Values that are not given depend on whether there are pictures, on where
// it begins and on how many Gaussians there are.
struct RefineOptions {
  std::filesystem::path images;  // project with the training pictures (fit/training_views.h); empty: without any
  // A network's file (upscale/upscaler.h): the views to compare with are those of `images`, or of the splat, enlarged
  // by it (enhance/enlarged_targets.h). Empty: as they are.
  std::filesystem::path enlarge_with;
  WorldOrigin origin = {0, 0, 0};  // of the splat's means, for the pictures' cameras; set by Enhance()
  // What the pictures' alpha is laid over, and the splat; otherwise what the cameras' file says, else the splat's own
  // comment (core/splat_comments.h), else black.
  std::optional<std::array<float, 3>> background;
  // Every Nth view is not trained on, as in fits; 0: all are. Nothing: every eighth, or, where the splat agrees with
  // those as well as with the others, so that its fit has seen them, all: then they could not tell what is better.
  std::optional<int> hold_out;
  int downscale = 1;  // pixels of a picture per side that become one, as in fits
  std::optional<int64_t> steps;
  std::optional<double> seconds;           // instead of steps: as many as there are in that time. Not reproducible
  std::optional<int> copies;               // K that every Gaussian is split into at the beginning
  int64_t max_gaussians = 0;               // of the result at most; 0: no bound
  int poses = 128;                         // without pictures and cameras: places to look from
  int between = 1;                         // without pictures: poses between each camera and its neighbours
  double half_from = 0.3, all_from = 0.7;  // see PixelSchedule
  std::optional<double> rate;              // of fits' learning rates, at the beginning …
  double rate_decay = 0.1;                 // … and what is left of it at the end
  double ssim_weight = 0.2;
  bool exposure = false;  // pictures may differ in brightness and tint
  bool robust = false;    // what differs grossly is not in the scene
  bool align = false;     // the pictures' poses are a little off (fit/view_pose.h)
};

// How it is run.
struct RefineControl {
  // Empty: none is written or read. Written when the user stops it and as often as
  // checkpoint_every says, unless it runs for seconds; never removed.
  std::filesystem::path checkpoint;
  int64_t checkpoint_every = 0;                // steps; 0: only when the user stops it
  bool resume = false;                         // go on from `checkpoint` if it is there
  std::vector<std::filesystem::path> outputs;  // that its caller writes, also when it was interrupted
};

// How well a splat agrees with views, seen closer and averaged down to their resolution. SSIM is 0 for views without
// room for its window.
struct Consistency {
  double psnr = 0;  // dB
  double ssim = 0;
};

// What a refinement is going to do, decided before anything is optimised.
struct RefinePlan {
  RefineOptions options;       // steps (unless it runs for seconds), copies and rate are chosen
  bool from_input = false;     // it begins with the splat as it was fitted, not with the start that it was given
  bool nothing_to_do = false;  // the start shows what the splat does already, or there is no width to give back
  Consistency start;           // of what it begins with
  // dB that it has to gain, or else the start is kept. More than 0 for a splat that may know more than the pictures
  // show.
  double least_gain = 0;
  std::vector<int> each;  // that every Gaussian is split into, where that is not the same for all; gone once they are
  int64_t gaussians = 0;  // that the iterations begin with; 0 where a checkpoint brings them
  std::string why;        // for people; empty where there is nothing special
};

inline constexpr int kMostCopies = 64;

// kBadArgument for what cannot be run; names the option.
Status Validate(const RefineOptions& options);

// Sets the option that is called `key` on the command line (`--k` is "k") to `value`: a number; 0 or 1 for switches.
// What goes together is for Validate to see when all are set. `images` and the control are not among them.
//
// Errors (kBadArgument): a key that is none, with those there are; a value that is no number, or no whole one where a
// whole one is needed.
Status SetRefineOption(RefineOptions& options, std::string_view key, std::string_view value);

// The keys of SetRefineOption, separated by commas.
std::string RefineOptionKeys();

// Changes when the same options come to another result.
inline constexpr int kRefineRevision = 2;

// All options as one JSON object, 0 for what is not given: for checkpoints.
std::string ToJsonText(const RefineOptions& options);

}  // namespace anchorsplat

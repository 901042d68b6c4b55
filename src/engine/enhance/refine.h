#pragma once

#include <cstdint>
#include <optional>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/refine_options.h"
#include "fit/fitter.h"

namespace anchorsplat {

// Refinement: optimises a splat until its renders at u times the resolution, averaged down to the pixels of its
// training views, match these views. A standard fit only has to match at pixel centres, with Gaussians that its
// rasterizer widens by 0.3 px²; this asks for what a camera sees. Many views with different pixel phases say more about
// the surface than one pixel each: multi-view super-resolution without a network.
//
// The views are the pictures the splat was fitted to or, without pictures, ordinary renders of the splat itself. Those
// are as right as the fit was, and worse at poses far from all training views. docs/refine.md says what either
// achieves.
struct RefineInput {
  GaussianCloud cloud;               // the splat as fitted, without non-finite rows
  GaussianCloud start;               // initial state: the filter's result, or a network's
  int64_t fixed = 0;                 // number of last Gaussians in both that are drawn but not optimised
  bool start_has_detail = false;     // `start` is from a network and shows more than the splat
  double upscale = 4;                // u, 1 to kMostSamples
  double pixel_size = 0;             // world units; only needed without pictures and cameras
  std::optional<CameraSet> cameras;  // the training cameras, used without pictures
  std::optional<int> times_larger;   // sides of the pictures over those of the pictures fitted to; unset: measured
  uint64_t seed = 0;
};

// What was done, for the log and for --json.
struct RefineReport {
  RefinePlan plan;
  int64_t steps = 0;         // in total
  int64_t resumed_at = 0;    // steps from a checkpoint
  bool interrupted = false;  // stopped by the user
  bool kept_start = false;   // the result matched the views no better than the start (or by less than plan.least_gain),
                             // so the start was returned
  int64_t views = 0;         // number of target views
  int copies = 1;            // K; with pictures, its mean
  std::optional<double> input_psnr;  // dB, ordinary renders of the input against the pictures
  // dB against held-out views (if any) at their own resolution, before and after.
  double before = 0, after = 0;
  int64_t pruned = 0;  // Gaussians removed as invisible
  FitTimes times;
  double seconds = 0;
};

struct Refined {
  GaussianCloud cloud;  // without RefineInput::fixed
  RefineReport report;
};

// Refines a splat. With pictures it starts from the splat as fitted if that matches them better than `start`. Such a
// splat, and an antialiased one, is returned unchanged unless the match improves by 2 dB: it was trained on more than
// the pictures show. Logs its findings and shows progress with the current error.
//
// Errors: those of OpenProject, PosesAround and Refiner; kBadArgument if the pictures do not show this splat: its
// renders are below kLeastInputPsnr, a quarter of them match another view's picture better than their own, or most
// match better when moved by a pixel (enhance/refine_pictures.h).
Result<Refined> Refine(RefineInput input, const RefineOptions& options, const RefineControl& control);

// dB. Fits reach 25 and more; pictures of something else, or in another order, mostly stay below this.
inline constexpr double kLeastInputPsnr = 18;

}  // namespace anchorsplat

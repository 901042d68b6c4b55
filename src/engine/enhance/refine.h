#pragma once

#include <cstdint>
#include <optional>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/refine_options.h"
#include "fit/fitter.h"

namespace anchorsplat {

// Refinement: a splat is optimised until its pictures at u times the resolution, averaged down to the pixels of its
// training views, are what these views show. A standard fit only has to be right at the centres of its pixels, with
// Gaussians that its rasterizer widens by 0.3 px²; this asks for what a camera sees. Many views with different phases
// of their pixels say more about the surface than one pixel each: multi-view super-resolution without a network.
//
// The views are those of the pictures that the splat was fitted to, or, without pictures, what the splat itself shows
// there when rendered in the ordinary way. That is as right as the fit was; at poses far from all training views it is
// worse. docs/refine.md tells what either can reach.
struct RefineInput {
  GaussianCloud cloud;               // the splat as it was fitted; rows that are not finite are gone
  GaussianCloud start;               // where to begin: the filter's result, or a network's
  int64_t fixed = 0;                 // last Gaussians of both: they are drawn with the others and stay as they are
  bool start_has_detail = false;     // a network's: it shows more than the splat itself does
  double upscale = 4;                // u, 1 to kMostSamples
  double pixel_size = 0;             // world units; only needed without pictures and cameras
  std::optional<CameraSet> cameras;  // the training cameras, used without pictures
  uint64_t seed = 0;
};

// What was done, for people and for --json.
struct RefineReport {
  RefinePlan plan;
  int64_t steps = 0;         // done in all
  int64_t resumed_at = 0;    // steps that a checkpoint brought
  bool interrupted = false;  // stopped by the user
  bool kept_start = false;   // the result agreed no better with the views than the start did (or only a little better,
                             // where the splat knows more than the pictures): the start is the result
  int64_t views = 0;         // compared with
  int copies = 1;            // K; with pictures it is a mean
  std::optional<double> input_psnr;  // dB, of the input's ordinary renders against the pictures
  // Against views that were not trained on (where there are any), what they average to at their own resolution, dB.
  double before = 0, after = 0;
  int64_t pruned = 0;  // that had become invisible
  FitTimes times;
  double seconds = 0;
};

struct Refined {
  GaussianCloud cloud;  // without RefineInput::fixed
  RefineReport report;
};

// With pictures it begins with the splat as it was fitted where that agrees better with them than `start`. Such a
// splat, and an antialiased one, comes back as it is unless it agrees with the pictures better by 2 dB in the end: it
// was trained on more than they show.
//
// Logs what it finds; shows progress with the error against the views.
//
// Errors: those of OpenProject, PosesAround and Refiner; kBadArgument when the pictures do not show this splat: when
// its own renders are farther from them than kLeastInputPsnr, when a quarter of them look more like another view's
// picture than like their own, or when most agree better moved by a pixel (see enhance/refine_pictures.h).
Result<Refined> Refine(RefineInput input, const RefineOptions& options, const RefineControl& control);

// dB. Fits reach 25 and more; pictures of something else, or in another order, mostly stay below.
inline constexpr double kLeastInputPsnr = 18;

}  // namespace anchorsplat

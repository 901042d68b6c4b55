#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "dataset/picture_defects.h"
#include "fit/fit_options.h"
#include "fit/initial_points.h"
#include "io/json_file.h"
#include "scene/view_set.h"

namespace anchorsplat {

// Where a fit's first Gaussians stand (fit/initial_points.h).
enum class FitStart {
  kSurface,  // the points of the low views: samples of the visible surface, or those of a project of pictures
  kRandom,   // gsplat's random cube
  kView,     // random where many cameras look
};
inline constexpr const char* kFitStartNames[] = {"surface", "random", "view"};  // by FitStart

// What decides which Gaussians come and go in a fit (`fit --strategy`).
inline constexpr const char* kStrategyNames[] = {"default", "absgrad", "mcmc"};  // by FitPreset

// Everything an object of the data set is made with: equal settings and an equal mesh make equal files.
struct ObjectSettings {
  ViewSetOptions views;
  int64_t fit_steps = kDefaultFitSteps;
  int downscale = 4;           // of objects that are pictures: high pixels per low one, along a side
  int hold_out = 8;            // every n-th low view is not trained on; 0: none
  int64_t max_gaussians = 0;   // of the fit; 0: no bound
  double min_train_psnr = 34;  // dB on the fit's own training views, below which an object is rejected; 0: never
  uint64_t seed = 0;           // of the surface samples, the fit, the defects and the backdrop

  // What makes a splat one of another kind; the defaults are those of standard fits.
  FitStart start = FitStart::kSurface;
  int64_t init_points = 0;             // of kRandom and kView; 0: kRandomPoints
  double init_extent = kRandomExtent;  // of kRandom: half a side of the cube, scene scales
  int sh_degree = kMaxShDegree;
  RenderMode mode = RenderMode::kClassic;
  bool pixel_area = false;  // the fit's pixels are means over their area (fit/pixel_model.h)
  FitPreset strategy = FitPreset::kDefault;
  bool mip_filter = false;  // Mip-Splatting's 3-D smoothing filter in training, fused on export
  PictureDefects defects;   // of the pictures and poses that the fit sees
  bool backdrop = false;    // the object stands in a textured room (backdrop.h); meshes only

  // An object without a fit of its own: the splat of the same mesh's entry `from` of the recipe, passed through
  // `after`, one of kAfterNames. Both empty or neither; all else are the settings of `from`.
  std::string from;
  std::string after;

  bool IsDerived() const { return !from.empty(); }
};

inline constexpr const char* kFitModeNames[] = {"classic", "antialiased"};  // by RenderMode
inline constexpr const char* kFitPixelNames[] = {"point", "area"};
// The writer and reader of a format, which quantise, or `anchorsplat enhance`.
inline constexpr const char* kAfterNames[] = {"spz", "sog", "splat", "enhanced"};

nlohmann::json ToJson(const ObjectSettings& settings);
// Errors (kBadFile) name the member.
Result<ObjectSettings> ObjectSettingsFrom(const JsonValue& json);

// kBadArgument: what cannot be built, such as views of one size or no steps.
Status Validate(const ObjectSettings& settings);

inline constexpr const char* kRigNames[] = {"sphere", "rings", "random"};  // by RigKind

}  // namespace anchorsplat

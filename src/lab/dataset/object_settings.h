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

// How a fit's initial points are chosen (fit/initial_points.h).
enum class FitStart {
  kSurface,  // points of the low views: visible surface samples, or those of a project of pictures
  kRandom,   // gsplat's random cube
  kView,     // random where many cameras look
};
inline constexpr const char* kFitStartNames[] = {"surface", "random", "view"};  // by FitStart

// Strategies that add and remove Gaussians in a fit (`fit --strategy`).
inline constexpr const char* kStrategyNames[] = {"default", "absgrad", "mcmc"};  // by FitPreset

// Everything an object is built with: equal settings and mesh give equal files.
struct ObjectSettings {
  ViewSetOptions views;
  int64_t fit_steps = kDefaultFitSteps;
  int downscale = 4;           // for objects made of pictures: high pixels per low pixel side
  int hold_out = 8;            // holds out every n-th low view; 0: none
  int64_t max_gaussians = 0;   // of the fit; 0: no limit
  double min_train_psnr = 34;  // dB on the fit's training views below which the object is rejected; 0: never
  uint64_t seed = 0;           // of surface samples, fit, defects and backdrop

  // Settings that make other kinds of splats; the defaults are those of standard fits.
  FitStart start = FitStart::kSurface;
  int64_t init_points = 0;             // for kRandom and kView; 0: kRandomPoints
  double init_extent = kRandomExtent;  // for kRandom: half the side of the cube, scene scales
  int sh_degree = kMaxShDegree;
  RenderMode mode = RenderMode::kClassic;
  bool pixel_area = false;  // fits averages over pixel areas (fit/pixel_model.h)
  FitPreset strategy = FitPreset::kDefault;
  bool mip_filter = false;  // Mip-Splatting's 3-D smoothing filter in training, fused on export
  PictureDefects defects;   // of the pictures and poses used for the fit
  bool backdrop = false;    // puts the object in a textured room (backdrop.h); meshes only

  // For derived objects: the recipe entry `from` of the same mesh whose splat is processed by `after`, one of
  // kAfterNames. Set both or neither; all other settings are those of `from`.
  std::string from;
  std::string after;

  bool IsDerived() const { return !from.empty(); }
};

inline constexpr const char* kFitModeNames[] = {"classic", "antialiased"};  // by RenderMode
inline constexpr const char* kFitPixelNames[] = {"point", "area"};
// Writing and reading a format that quantises, or `anchorsplat enhance`.
inline constexpr const char* kAfterNames[] = {"spz", "sog", "splat", "enhanced"};

nlohmann::json ToJson(const ObjectSettings& settings);
// Errors (kBadFile) name the member.
Result<ObjectSettings> ObjectSettingsFrom(const JsonValue& json);

// kBadArgument: settings that cannot be built, such as equal view sizes or no steps.
Status Validate(const ObjectSettings& settings);

inline constexpr const char* kRigNames[] = {"sphere", "rings", "random"};  // by RigKind

}  // namespace anchorsplat

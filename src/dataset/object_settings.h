#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>

#include "core/result.h"
#include "fit/fit_options.h"
#include "io/json_file.h"
#include "scene/view_set.h"

namespace anchorsplat {

// Everything an object of the data set is made with: equal settings and an equal mesh make equal files.
struct ObjectSettings {
  ViewSetOptions views;
  int64_t fit_steps = kDefaultFitSteps;
  int downscale = 4;           // of objects that are pictures: high pixels per low one, along a side
  int hold_out = 8;            // every n-th low view is not trained on; 0: none
  int64_t max_gaussians = 0;   // of the fit; 0: no bound
  double min_train_psnr = 34;  // dB on the fit's own training views, below which an object is rejected; 0: never
  uint64_t seed = 0;           // of the surface samples and the fit
};

nlohmann::json ToJson(const ObjectSettings& settings);
// Errors (kBadFile) name the member.
Result<ObjectSettings> ObjectSettingsFrom(const JsonValue& json);

// kBadArgument: what cannot be built, such as views of one size or no steps.
Status Validate(const ObjectSettings& settings);

inline constexpr const char* kRigNames[] = {"sphere", "rings", "random"};  // by RigKind

}  // namespace anchorsplat

#pragma once

#include <optional>

#include "core/render_mode.h"
#include "reading/reading.h"

namespace anchorsplat {

// What is known besides the splat, and which methods are allowed.
struct TreatmentRequest {
  std::optional<RenderMode> mode = {};  // render mode in training, from the file's tag or the caller
  bool mode_is_given = false;           // given by the caller: use it whatever the reading says
  std::optional<double> pixel = {};     // training pixel if known, world units
  bool filter = true, network = true;   // allowed methods
  double loss_weight = kLossWeight;     // other values serve measurements
};

enum class TreatmentMethod { kNone, kFilter, kNetwork };

// What to do with a splat.
struct Treatment {
  TreatmentMethod method = TreatmentMethod::kNone;
  RenderMode mode = RenderMode::kClassic;  // for rendering and enhancement
  double pixel = 0;                        // training pixel to assume, world units
  double gain = 0;                         // expected gain, dB; 0: unknown
};

// The only policy: picks the pixel size, method and mode with the greatest expected gain, with losses weighted by
// loss_weight. Picks kNone if that is negative.
Treatment Treat(const Reading& reading, const TreatmentRequest& request);

}  // namespace anchorsplat

#pragma once

#include <optional>

#include "core/render_mode.h"
#include "reading/reading.h"

namespace anchorsplat {

// What is known besides the splat, and what may be done.
struct TreatmentRequest {
  std::optional<RenderMode> mode = {};  // of its training: the file's tag, or the caller's
  bool mode_is_said = false;            // by the caller, who wants it enhanced as such whatever it looks like
  std::optional<double> pixel = {};     // training pixel, world units, where that is known
  bool filter = true, network = true;   // which may be chosen
  double losses_count = kLossesCount;   // others are for measuring what that does
};

enum class TreatmentMethod { kNone, kFilter, kNetwork };

// What to do with a splat.
struct Treatment {
  TreatmentMethod method = TreatmentMethod::kNone;
  RenderMode mode = RenderMode::kClassic;  // to be drawn as, and to be enhanced as
  double pixel = 0;                        // world units, to be taken for that of the training
  double gain = 0;                         // dB that are expected of it; 0: nobody knows
};

// The one policy: of all pixels, methods and modes that are possible the one with the greatest expected gain, where
// what is lost counts several times; nothing where that is below nothing.
Treatment Treat(const Reading& reading, const TreatmentRequest& request);

}  // namespace anchorsplat

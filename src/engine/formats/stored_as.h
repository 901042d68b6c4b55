#pragma once

#include <string>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Actual meaning of a file's numbers, if a program deviated from the format.
struct StoredAs {
  bool lengths = false;    // scales are lengths, not logarithms
  bool opacities = false;  // opacities are 0–1, not logits
  float max_color = 0;     // f_dc are colours up to this value, 1 or 255; 0: harmonics
  friend bool operator==(const StoredAs&, const StoredAs&) = default;
};

// Converts such a cloud to stored space, in place. `full_color`: the reader already converted colours with this full
// intensity (ExtraProperties); 0: as stored.
void ConvertToStored(GaussianCloud& cloud, const StoredAs& stored, float full_color = 0);

// Warns if the values look like that and `told` does not say so. `name`: the file, for messages.
void WarnOfStored(const std::string& name, const CloudView& cloud, const StoredAs& told);

}  // namespace anchorsplat

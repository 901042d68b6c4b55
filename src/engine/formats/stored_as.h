#pragma once

#include <string>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// What a file's numbers mean where a program wrote others than the format wants.
struct StoredAs {
  bool lengths = false;    // scales, instead of their logarithms
  bool opacities = false;  // 0–1, instead of logits
  float color_of_one = 0;  // f_dc are colours of which this is the largest, 1 or 255, instead of harmonics; 0: they are
  friend bool operator==(const StoredAs&, const StoredAs&) = default;
};

// Makes such numbers of a cloud what they ought to be. In place. `full_color`: the reader has made harmonics of colours
// already and took this for their largest (ExtraProperties); 0: they are as stored.
void MakeStored(GaussianCloud& cloud, const StoredAs& stored, float full_color = 0);

// Warns where they look so, and `told` does not say it. `name`: the file, for people.
void WarnOfStored(const std::string& name, const CloudView& cloud, const StoredAs& told);

}  // namespace anchorsplat

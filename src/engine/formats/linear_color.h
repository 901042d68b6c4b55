#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Converts splats with linear colours (BT.709, display-referred), which few programs train, to sRGB, which all others
// use. Degree 0 is converted exactly (IEC 61966-2-1). With harmonics, the colour over all directions is approximated by
// harmonics of the same degree (least squares over directions). Blending differs in any case, as it then mixes sRGB
// instead of light.
class LinearColor {
 public:
  explicit LinearColor(int sh_degree);

  // Converts one Gaussian's harmonics in place, laid out as GaussianCloud::sh. Negative colours become black; NaN
  // stays.
  void ToSrgb(float* sh) const;

 private:
  int coefficients_;
  std::vector<double> basis_;    // [directions, coefficients]
  std::vector<double> inverse_;  // [coefficients, directions]
};

// Text for warnings: "its colours are linear light and become sRGB …".
std::string LinearColorInWords(int sh_degree);

// Converts rows [first, first + count) of a cloud.
void SrgbFromLinear(GaussianCloud& cloud, int64_t first, int64_t count);

}  // namespace anchorsplat

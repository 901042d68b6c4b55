#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Splats whose colours are linear light (BT.709, display-referred), as few programs train them, made ones of sRGB, as
// all others are. A Gaussian of degree 0 gets exactly the colour that its own becomes (IEC 61966-2-1). With harmonics,
// the colour as seen from all sides becomes the nearest one that harmonics of this degree can say (least squares over
// directions). Blending differs in any case: of sRGB instead of light.
class LinearColor {
 public:
  explicit LinearColor(int sh_degree);

  // In place: one Gaussian's harmonics, as in GaussianCloud::sh. Negative colours count as black, NaN stays.
  void ToSrgb(float* sh) const;

 private:
  int coefficients_;
  std::vector<double> basis_;    // [directions, coefficients]
  std::vector<double> inverse_;  // [coefficients, directions]
};

// What there is to say of it, for warnings: "its colours are linear light and become sRGB …".
std::string LinearColorInWords(int sh_degree);

// Rows [first, first + count) of a cloud.
void SrgbFromLinear(GaussianCloud& cloud, int64_t first, int64_t count);

}  // namespace anchorsplat

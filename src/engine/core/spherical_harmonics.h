#pragma once

#include <array>

namespace anchorsplat {

// Real spherical harmonics of 3DGS (Kerbl et al. 2023; gsplat): colour = max(Σ c_k Y_k(d) + 0.5, 0), with d the unit
// vector from the camera centre to the Gaussian. The constants follow the order of the formulas of degree 0–3.
inline constexpr float kSh0 = 0.28209479177387814f;
inline constexpr float kSh1 = 0.48860251190291992f;
inline constexpr std::array<float, 3> kSh2 = {1.0925484305920792f, 0.94617469575755997f, 0.31539156525251999f};
inline constexpr float kSh2Diagonal = 0.54627421529603959f;
inline constexpr std::array<float, 7> kSh3 = {0.59004358992664352f, 2.8906114426405538f, 0.45704579946446572f,
                                              2.2852289973223288f,  1.865881662950577f,  1.1195289977703462f,
                                              1.4453057213202769f};

// All 16 basis functions at unit direction (x, y, z), in the order of the stored coefficients.
template <typename T>
std::array<T, 16> ShBasis(T x, T y, T z) {
  const T xx = x * x, yy = y * y, zz = z * z;
  return {T(kSh0),
          -T(kSh1) * y,
          T(kSh1) * z,
          -T(kSh1) * x,
          T(kSh2[0]) * x * y,
          -T(kSh2[0]) * y * z,
          T(kSh2[1]) * zz - T(kSh2[2]),
          -T(kSh2[0]) * x * z,
          T(kSh2Diagonal) * (xx - yy),
          -T(kSh3[0]) * y * (3 * xx - yy),
          T(kSh3[1]) * x * y * z,
          y * (T(kSh3[2]) - T(kSh3[3]) * zz),
          z * (T(kSh3[4]) * zz - T(kSh3[5])),
          x * (T(kSh3[2]) - T(kSh3[3]) * zz),
          T(kSh3[6]) * z * (xx - yy),
          -T(kSh3[0]) * x * (xx - 3 * yy)};
}

// Stored DC coefficient of a colour in 0–1, and back.
constexpr float DcFromColor(float color) { return (color - 0.5f) / kSh0; }
constexpr float ColorFromDc(float dc) { return 0.5f + kSh0 * dc; }

}  // namespace anchorsplat

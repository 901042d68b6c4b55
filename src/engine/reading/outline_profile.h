#pragma once

#include <array>
#include <cstdint>

#include "core/image.h"

namespace anchorsplat {

// Measures the softness of outlines in alpha pictures: the world length over which alpha rises, in a given unit.
//
// At each point where the line between two neighbouring pixels crosses a level, the outline's width is 1 / |∇α|, from
// central differences interpolated linearly between the two. Crossings are weighted by how perpendicular the line
// crosses the outline, so outlines of all directions count by their length.
inline constexpr std::array<float, 4> kOutlineLevels = {0.25f, 0.5f, 0.75f, 0.9f};
inline constexpr std::array<double, 4> kOutlineQuantiles = {0.1, 0.25, 0.5, 0.75};
// Alpha bands. A band's area over the outline's length is the mean width of outlines, thin and translucent parts
// included.
inline constexpr std::array<float, 9> kOutlineBands = {0.02f, 0.1f, 0.3f, 0.5f, 0.7f, 0.85f, 0.95f, 0.985f, 0.997f};

inline constexpr size_t kOutlineValues = kOutlineLevels.size() * kOutlineQuantiles.size() + (kOutlineBands.size() - 1);

class OutlineProfile {
 public:
  // Adds a picture: [1,H,W], or the first channel of more. `pixel`: its pixel side in units of the length. The
  // outermost pixels only serve differences. `cut`, `coarse`: [H,W], alpha due to cut and to coarse Gaussians; where
  // that exceeds a fifth of alpha the outline is excluded. The same bits for any number of threads.
  void Add(const Image& alpha, double pixel, const float* cut = nullptr, const float* coarse = nullptr);

  // Shares of the outlines' length at alpha ½ that were excluded: due to cut Gaussians, due to coarse ones alone.
  double Cut() const { return ShareOf(cut_); }
  double Coarse() const { return ShareOf(coarse_); }

  // Natural logarithms: per level the width quantiles, then per band area / (outline length at ½ × band width). 0 for a
  // level that is never crossed. Areas and lengths count one extra pixel, to stay finite.
  std::array<double, kOutlineValues> Values() const;

 private:
  // Log-scale histogram of widths from e^kFirst in steps of kStep; the end bins include everything beyond.
  static constexpr double kFirst = -4, kStep = 0.05;
  static constexpr size_t kBins = 180;

  struct Sums {
    std::array<std::array<double, kBins>, kOutlineLevels.size()> widths{};  // weights
    std::array<int64_t, kOutlineBands.size() - 1> pixels{};                 // per band
    int64_t crossings = 0;                                                  // of level ½
    int64_t cut = 0, coarse = 0;                                            // excluded crossings
  };
  struct LeftOut {
    const float* cut;
    const float* coarse;
  };
  static void AddRows(const Image& alpha, double pixel, const LeftOut& left_out, int first, int last, Sums& sums);
  double ShareOf(double length) const { return length > 0 ? length / (cut_ + coarse_ + length_) : 0; }

  std::array<std::array<double, kBins>, kOutlineLevels.size()> widths_{};
  std::array<double, kOutlineBands.size() - 1> areas_{};
  double length_ = 0, cut_ = 0, coarse_ = 0, last_pixel_ = 1;
};

}  // namespace anchorsplat

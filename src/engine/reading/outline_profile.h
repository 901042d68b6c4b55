#pragma once

#include <array>
#include <cstdint>

#include "core/image.h"

namespace anchorsplat {

// How soft the outlines in pictures of alpha are: the world length in which alpha rises, in units of a given length.
//
// Where the line between two neighbouring pixels crosses a level, alpha's gradient there (central differences, linear
// between the two) says how wide the outline would be if it went on rising like that: 1 / |∇α|. Crossings count by how
// straight the line crosses, so that outlines of all directions count by their length.
inline constexpr std::array<float, 4> kOutlineLevels = {0.25f, 0.5f, 0.75f, 0.9f};
inline constexpr std::array<double, 4> kOutlineQuantiles = {0.1, 0.25, 0.5, 0.75};
// Bands of alpha, whose areas over the outline's length say how wide outlines are on average, thin and translucent
// parts included.
inline constexpr std::array<float, 9> kOutlineBands = {0.02f, 0.1f, 0.3f, 0.5f, 0.7f, 0.85f, 0.95f, 0.985f, 0.997f};

inline constexpr size_t kOutlineValues = kOutlineLevels.size() * kOutlineQuantiles.size() + (kOutlineBands.size() - 1);

class OutlineProfile {
 public:
  // Adds a picture, [1,H,W] or the first channel of one, whose pixels have the side `pixel` in units of the length. The
  // outermost pixels only serve differences. Bit-identical for any number of threads. `cut`, `coarse`: [H,W], how much
  // of alpha is of Gaussians that were cut, and of others that are coarse; what they have a fifth of is left out.
  void Add(const Image& alpha, double pixel, const float* cut = nullptr, const float* coarse = nullptr);

  // Share of the outlines, by their length at ½, that was left out because of those that were cut, and because of the
  // coarse ones alone.
  double Cut() const { return ShareOf(cut_); }
  double Coarse() const { return ShareOf(coarse_); }

  // Natural logarithms: per level the quantiles of the widths, then per band area / (length of the outline at ½ × width
  // of the band). 0 for a level that is crossed nowhere; areas and lengths have one pixel more than there are, so that
  // they are finite.
  std::array<double, kOutlineValues> Values() const;

 private:
  // Widths on a logarithmic scale from e^kFirst in steps of kStep; what lies beyond counts at the ends.
  static constexpr double kFirst = -4, kStep = 0.05;
  static constexpr size_t kBins = 180;

  struct Sums {
    std::array<std::array<double, kBins>, kOutlineLevels.size()> widths{};  // weights
    std::array<int64_t, kOutlineBands.size() - 1> pixels{};                 // per band
    int64_t crossings = 0;                                                  // of ½
    int64_t cut = 0, coarse = 0;                                            // left out
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

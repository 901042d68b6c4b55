#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/render_mode.h"
#include "core/result.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// How a splat was made, or what has become of it: what a reading tells apart.
enum class Made { kClassic, kAntialiased, kMip, kFiltered, kEnhanced, kRaised, kMesh, kGenerated };
inline constexpr size_t kMadeCount = 8;
std::string_view NameOf(Made made);   // "classic", "antialiased", …, as in the table of readings
std::string_view InWords(Made made);  // "an antialiased splat"
// Whether it has its width: of Mip-Splatting, filtered or enhanced before, made of a mesh.
bool HasItsWidth(Made made);

// What gains are known of: in each render mode with the filter, then with a network.
inline constexpr size_t kGainCount = 6;
constexpr size_t GainOf(RenderMode mode, bool network) { return 2 * static_cast<size_t>(mode) + (network ? 1 : 0); }
// Of pixels that are taken, in multiples of the true one.
inline constexpr std::array<double, 7> kGainMultiples = {0.25, 0.35, 0.5, 0.7, 1, 1.4, 2};

// What one member of the ensemble says of a splat.
struct ReadingOpinion {
  double log_pixel = 0;                     // ln(training pixel / unit)
  double log_spread = 0;                    // ln of its mean absolute error
  std::array<double, kMadeCount> logits{};  // of Made
  // Squashed, SquashGain(dB); and ln of their deviation.
  std::array<std::array<double, kGainMultiples.size()>, kGainCount> gains{}, log_deviations{};
};

// Gains beyond a few dB count by their logarithm.
double SquashGain(double decibels);

// Perceptrons of two hidden layers (SiLU) that have learned from the table of readings, all of the same features
// (scripts/train-reading.py).
class ReadingModel {
 public:
  // Errors (kBadFile): tensors that are missing or of another shape, other features than FeatureNames().
  static Result<ReadingModel> Load(const TensorFile& file);
  // The one that is part of the program.
  static const ReadingModel& Shipped();
  static std::string ShippedIdentity();  // other weights, another text

  // `features`: SplatFeatures::values.
  std::vector<ReadingOpinion> OpinionsOf(std::span<const double> features) const;

  // How far the splat lies from those that were learned from: root mean square of the features' deviations, over what
  // 98 % of splats that were not learned from stay below.
  double Strangeness(std::span<const double> features) const;

  // By which the mean absolute error is multiplied so that an interval of that much on either side holds 80 % of the
  // pixels of splats that were not learned from.
  double interval() const { return interval_; }

  // Standard deviation of ln of what is said of the pixels of places of one splat, less the true ones, around its mean.
  double place_error() const { return place_error_; }

 private:
  struct Layer {
    size_t inputs = 0, outputs = 0;
    std::vector<float> weights, bias;  // [members, outputs, inputs], [members, outputs]
  };
  std::vector<float> Scaled(std::span<const double> features) const;

  size_t members_ = 0;
  std::vector<float> mean_, deviation_;
  std::array<Layer, 3> layers_;
  double interval_ = 1, farthest_ = 1, place_error_ = 0;
};

}  // namespace anchorsplat

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

// How a splat was made, or last processed.
enum class Provenance { kClassic, kAntialiased, kMip, kFiltered, kEnhanced, kRaised, kMesh, kGenerated };
inline constexpr size_t kProvenanceCount = 8;
std::string_view NameOf(Provenance made);    // "classic", "antialiased", …, as in the table of readings
std::string_view Describe(Provenance made);  // "an antialiased splat"
// Whether splats of this provenance have their full width: fitted by Mip-Splatting, already filtered or enhanced, or
// made from a mesh.
bool HasFullWidth(Provenance made);

// Predicted gains: per render mode with the filter, then with a network.
inline constexpr size_t kGainCount = 6;
constexpr size_t GainOf(RenderMode mode, bool network) { return 2 * static_cast<size_t>(mode) + (network ? 1 : 0); }
// Assumed pixel sizes at which gains are predicted, in multiples of the true one.
inline constexpr std::array<double, 7> kGainMultiples = {0.25, 0.35, 0.5, 0.7, 1, 1.4, 2};

// Prediction of one member of the ensemble.
struct ReadingPrediction {
  double log_pixel = 0;                           // ln(training pixel / unit)
  double log_spread = 0;                          // ln of the mean absolute error of log_pixel
  std::array<double, kProvenanceCount> logits{};  // of Provenance
  // Expectations of SquashGain(gain in dB), and of its part below zero, sign changed.
  std::array<std::array<double, kGainMultiples.size()>, kGainCount> gains{}, losses{};
};

// Compresses gains: logarithmic beyond a few dB.
double SquashGain(double decibels);

// Ensemble of perceptrons with two hidden layers (SiLU) on the same features, trained on the table of readings
// (scripts/train-reading.py).
class ReadingModel {
 public:
  // Errors (kBadFile): missing tensors or wrong shapes; features other than FeatureNames(); other outputs.
  static Result<ReadingModel> Load(const TensorFile& file);
  // The model built into the program.
  static const ReadingModel& Shipped();
  static std::string ShippedIdentity();  // differs when the weights differ

  // `features`: SplatFeatures::values.
  std::vector<ReadingPrediction> Predict(std::span<const double> features) const;

  // Distance of a splat from the training set: RMS of the features' deviations, over the 98 % quantile for held-out
  // splats.
  double Strangeness(std::span<const double> features) const;

  // Factor from mean absolute error to the half-width of an interval that holds the true pixel for 80 % of held-out
  // splats.
  double interval() const { return interval_; }

  // Standard deviation, within one splat, of ln(predicted / true pixel) of places around its mean.
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

#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/result.h"
#include "model/shared/tensor_spec.h"

namespace anchorsplat {

// In what a compact network measures how far a copy lies from its anchor, per axis of the anchor's own frame.
enum class OffsetUnit {
  kScale,  // the anchor's scale along the axis after the filter
  kPixel,  // p_LR
  kCube,   // the side of the cube that the published network sees (model/shared/normalisation.h): the same for all
           // Gaussians
};

// Whom a Gaussian hears from.
enum class CompactContext {
  kNearest,  // the M nearest
  kPatches,  // the M others of its patch: M + 1 consecutive Gaussians along a Hilbert curve, as PTv3 groups points. The
             // curve runs along the world's axes, so the output no longer turns with the splat
};

// Shape of a compact network: a few rounds of messages between neighbours instead of a backbone, residuals on top of
// the filter. docs/network.md has the formulas.
struct CompactConfig {
  int64_t copies = 4;         // K
  int64_t hidden = 64;        // H, width of a Gaussian's state
  int64_t rounds = 2;         // R, of messages
  int64_t neighbours = 8;     // M
  int64_t head_hidden = 128;  // G, width of the layers that make residuals of a state
  bool prior = true;    // residuals are on top of the filter, with a learned f per Gaussian; else on the splat as it is
  bool anchors = true;  // offsets are bounded by ε
  bool sh = true;       // spherical harmonics of degree 1 to 3 change too
  bool knows_kind = false;  // Gaussians are told of their splat's kind: strength of the filter, render mode
  CompactContext context = CompactContext::kNearest;
  OffsetUnit offset_unit = OffsetUnit::kScale;
  double epsilon = 1;   // ε, in offset units
  double spread = 0.5;  // of the copies at the start, in standard deviations along the two longest axes
};

// Calls visitor.Whole(key, low, high, value), .Flag(key, value), .Number(key, low, high, value) and
// .Text(key, choices, value) for every option: the one place that knows their names and ranges.
template <typename Visitor>
void VisitCompactOptions(CompactConfig& config, Visitor& visitor) {
  visitor.Whole("copies", 1, 64, config.copies);
  visitor.Whole("hidden", 16, 512, config.hidden);
  visitor.Whole("rounds", 0, 8, config.rounds);
  visitor.Whole("neighbours", 1, 64, config.neighbours);
  visitor.Whole("head_hidden", 16, 512, config.head_hidden);
  visitor.Flag("prior", config.prior);
  visitor.Flag("anchors", config.anchors);
  visitor.Flag("sh", config.sh);
  visitor.Flag("knows_kind", config.knows_kind);
  const auto choose = [&](const std::string& key, const std::vector<std::string>& names, auto& value) {
    std::string name = names[static_cast<size_t>(value)];
    visitor.Text(key, names, name);
    for (size_t i = 0; i < names.size(); ++i) {
      if (names[i] == name) value = static_cast<std::remove_reference_t<decltype(value)>>(i);
    }
  };
  choose("context", {"neighbours", "patches"}, config.context);
  choose("offset_unit", {"scale", "pixel", "cube"}, config.offset_unit);
  visitor.Number("epsilon", 1e-6, 1e3, config.epsilon);
  visitor.Number("spread", 0, 1, config.spread);
}

// kBadArgument: hidden or head_hidden is not a multiple of 16 (the kernels work on whole vectors).
Status Validate(const CompactConfig& config);

// As metadata of a file: "format" and "option.copies", "option.hidden", …
inline constexpr const char* kCompactFormat = "anchorsplat-compact";
std::map<std::string, std::string> ToMetadata(const CompactConfig& config);

// Back. Absent options keep their defaults, keys that do not begin with "option." are none of our business.
// kBadFile: an option that there is not, a value out of range or of another kind, and what Validate says. Messages name
// the key.
Result<CompactConfig> CompactConfigFromMetadata(const std::map<std::string, std::string>& metadata);

// What residuals are made of, in the order of the output row: first f, then for every copy the others. `gain` and
// `bound`: a raw output y becomes bound · tanh(gain · y / bound).
struct CompactAttribute {
  const char* name;
  int64_t channels;
  double gain, bound;
};
inline constexpr CompactAttribute kStrengthAttribute = {"strength", 1, 0.5, 0.5};
// Offsets are in units of ε, rotations in radians, opacities in logits, colours in SH coefficients.
inline constexpr CompactAttribute kCopyAttributes[] = {
    {"means", 3, 1, 1},    {"scales", 3, 1, 2},    {"rotation", 3, 0.2, 0.5}, {"opacity", 1, 2, 6},
    {"colour", 3, 0.5, 2}, {"sh_gain", 3, 0.5, 1}, {"sh_linear", 9, 0.2, 1}};
inline constexpr int64_t kAttributesWithoutSh = 5;

std::span<const CompactAttribute> CopyAttributes(const CompactConfig& config);
int64_t ChannelsPerCopy(const CompactConfig& config);
int64_t CompactOutputs(const CompactConfig& config);  // 1 + K · ChannelsPerCopy

// How many features of a Gaussian the network sees (model/compact/compact_features.h).
int64_t NodeFeatures(const CompactConfig& config);

// All tensors of a compact network's file: parameters, then the range of the training data ("domain.low" and
// "domain.high").
std::vector<TensorSpec> CompactTensors(const CompactConfig& config);

}  // namespace anchorsplat

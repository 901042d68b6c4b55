#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/result.h"
#include "network/tensor_spec.h"

namespace anchorsplat {

// Unit of a copy's offset from its anchor, per axis of the anchor's frame.
enum class OffsetUnit {
  kScale,  // the anchor's scale along the axis after the filter
  kPixel,  // p_LR
  kCube,   // side of the published network's cube (network/normalisation.h), equal for all Gaussians
};

// Which Gaussians send messages to a Gaussian.
enum class CompactContext {
  kNearest,  // its M nearest
  kPatches,  // the M others in its patch: M + 1 consecutive Gaussians on a Hilbert curve, as in PTv3. The curve follows
             // the world axes, so the output is not equivariant to rotation
};

// Architecture of a compact network: a few rounds of message passing between neighbours instead of a backbone, and
// residuals on the filter. Formulas: docs/network.md.
struct CompactConfig {
  int64_t copies = 4;         // K
  int64_t hidden = 64;        // H, width of a Gaussian's state
  int64_t rounds = 2;         // R, rounds of message passing
  int64_t neighbours = 8;     // M
  int64_t head_hidden = 128;  // G, width of the layers that turn a state into residuals
  bool prior = true;          // residuals on the filter, with a learned f per Gaussian; else on the unfiltered splat
  bool anchors = true;        // offsets are bounded by ε
  bool sh = true;             // changes SH of degrees 1 to 3 too
  bool knows_kind = false;    // the input includes the splat's kind: filter strength and render mode
  CompactContext context = CompactContext::kNearest;
  OffsetUnit offset_unit = OffsetUnit::kScale;
  double epsilon = 1;   // ε, in offset units
  double spread = 0.5;  // of the initial copies, in standard deviations along the two longest axes
};

// Calls visitor.Integer(key, low, high, value), .Flag(key, value), .Number(key, low, high, value) or .Text(key,
// choices, value) for each option. The only place that knows their names and ranges.
template <typename Visitor>
void VisitCompactOptions(CompactConfig& config, Visitor& visitor) {
  visitor.Integer("copies", 1, 64, config.copies);
  visitor.Integer("hidden", 16, 512, config.hidden);
  visitor.Integer("rounds", 0, 8, config.rounds);
  visitor.Integer("neighbours", 1, 64, config.neighbours);
  visitor.Integer("head_hidden", 16, 512, config.head_hidden);
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

// kBadArgument: hidden or head_hidden is not a multiple of 16, which the kernels require.
Status Validate(const CompactConfig& config);

// File metadata: "format", "option.copies", "option.hidden", …
inline constexpr const char* kCompactFormat = "anchorsplat-compact";
std::map<std::string, std::string> ToMetadata(const CompactConfig& config);

// Parses file metadata. Absent options keep their defaults; keys without the prefix "option." are ignored.
// Errors (kBadFile, naming the key): an unknown option; a value out of range or of the wrong type; those of Validate.
Result<CompactConfig> CompactConfigFromMetadata(const std::map<std::string, std::string>& metadata);

// The residuals, in output order: first f, then all others for each copy. A raw output y becomes bound · tanh(gain · y
// / bound).
struct CompactAttribute {
  const char* name;
  int64_t channels;
  double gain, bound;
};
inline constexpr CompactAttribute kStrengthAttribute = {"strength", 1, 0.5, 0.5};
// Units: offsets in ε, rotations in radians, opacities in logits, colours in SH coefficients.
inline constexpr CompactAttribute kCopyAttributes[] = {
    {"means", 3, 1, 1},    {"scales", 3, 1, 2},    {"rotation", 3, 0.2, 0.5}, {"opacity", 1, 2, 6},
    {"colour", 3, 0.5, 2}, {"sh_gain", 3, 0.5, 1}, {"sh_linear", 9, 0.2, 1}};
inline constexpr int64_t kAttributesWithoutSh = 5;

std::span<const CompactAttribute> CopyAttributes(const CompactConfig& config);
int64_t ChannelsPerCopy(const CompactConfig& config);
int64_t CompactOutputs(const CompactConfig& config);  // 1 + K · ChannelsPerCopy

// Number of input features per Gaussian (compact/compact_features.h).
int64_t NodeFeatures(const CompactConfig& config);

// All tensors of a compact network's file: parameters, then the training data's feature range ("domain.low" and
// "domain.high").
std::vector<TensorSpec> CompactTensors(const CompactConfig& config);

}  // namespace anchorsplat

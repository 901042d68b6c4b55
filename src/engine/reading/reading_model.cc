#include "reading/reading_model.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "core/buffer.h"
#include "core/fingerprint.h"
#include "core/include_bytes.h"
#include "core/text.h"
#include "reading/features.h"

ANCHORSPLAT_INCLUDE_BYTES("anchorsplat_reading_model", ANCHORSPLAT_READING_MODEL);
extern "C" {
extern const std::byte anchorsplat_reading_model[];
extern const std::byte anchorsplat_reading_model_end[];
}

namespace anchorsplat {

namespace {

constexpr float kMostDeviations = 4;  // standardised features are clamped to this
constexpr std::string_view kOutputs = "pixel provenance gains losses";
constexpr size_t kPredictionValues = 2 + kProvenanceCount + 2 * kGainCount * kGainMultiples.size();

float Silu(float x) { return x / (1 + std::exp(-x)); }
double Softplus(double x) { return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x))); }

Result<std::vector<float>> ReadAll(const TensorFile& file, std::string_view name, std::span<const int64_t> shape) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values values, file.ReadFloat32(name, shape));
  return std::vector<float>(values.values().begin(), values.values().end());
}

ReadingPrediction PredictionFrom(std::span<const float> said) {
  ReadingPrediction prediction;
  auto next = said.begin();
  prediction.log_pixel = double{*next++};
  prediction.log_spread = std::clamp(double{*next++}, -3.5, 1.0);
  for (double& logit : prediction.logits) logit = double{*next++};
  for (auto& curve : prediction.gains) {
    for (double& gain : curve) gain = double{*next++};
  }
  for (auto& curve : prediction.losses) {
    for (double& loss : curve) loss = Softplus(double{*next++});
  }
  return prediction;
}

}  // namespace

std::string_view NameOf(Provenance made) {
  constexpr std::array<std::string_view, kProvenanceCount> kNames = {"classic",  "antialiased", "mip",  "filtered",
                                                                     "enhanced", "raised",      "mesh", "generated"};
  return kNames[static_cast<size_t>(made)];
}

std::string_view Describe(Provenance made) {
  switch (made) {
    case Provenance::kClassic:
      return "a classic 3DGS fit";
    case Provenance::kAntialiased:
      return "an antialiased fit";
    case Provenance::kMip:
      return "a Mip-Splatting fit";
    case Provenance::kFiltered:
      return "an already filtered splat";
    case Provenance::kEnhanced:
      return "an already enhanced splat";
    case Provenance::kRaised:
      return "a fit with raised opacities";
    case Provenance::kMesh:
      return "a sampled mesh";
    case Provenance::kGenerated:
      return "the output of a generator";
  }
  return "";
}

bool HasFullWidth(Provenance made) {
  return made == Provenance::kMip || made == Provenance::kFiltered || made == Provenance::kEnhanced ||
         made == Provenance::kMesh;
}

double SquashGain(double decibels) { return 2 * std::asinh(decibels / 2); }

Result<ReadingModel> ReadingModel::Load(const TensorFile& file) {
  ReadingModel model;
  const std::vector<std::string>& names = FeatureNames();
  std::string expected;
  for (const std::string& name : names) expected += (expected.empty() ? "" : " ") + name;
  const auto features = file.metadata().find("features");
  if (features == file.metadata().end() || features->second != expected) {
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": this program does not compute the features it was trained on")};
  }
  const auto outputs = file.metadata().find("outputs");
  if (outputs == file.metadata().end() || outputs->second != kOutputs) {
    return Error{
        ErrorCode::kBadFile,
        Cat(file.name(), ": its outputs are those of another version; train it again with scripts/train-reading.py")};
  }
  const auto inputs = static_cast<int64_t>(names.size());
  ANCHORSPLAT_ASSIGN_OR_RETURN(model.mean_, ReadAll(file, "mean", std::array{inputs}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(model.deviation_, ReadAll(file, "deviation", std::array{inputs}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<float> calibration,
                               ReadAll(file, "calibration", std::array{int64_t{3}}));
  model.interval_ = double{calibration[0]};
  model.farthest_ = double{calibration[1]};
  model.place_error_ = double{calibration[2]};
  size_t before = names.size();
  for (size_t k = 0; k < model.layers_.size(); ++k) {
    const std::string name = Cat("layer", k, ".weight");
    const TensorEntry* const weight = file.Find(name);
    if (weight == nullptr || weight->shape.size() != 3 || weight->shape[2] != static_cast<int64_t>(before) ||
        weight->shape[0] < 1 || weight->shape[1] < 1 ||
        (k > 0 && weight->shape[0] != static_cast<int64_t>(model.members_))) {
      return Error{ErrorCode::kBadFile, Cat(file.name(), ": '", name, "' must be [members, outputs, ", before, "]")};
    }
    model.members_ = static_cast<size_t>(weight->shape[0]);
    Layer& layer = model.layers_[k];
    layer.inputs = before;
    layer.outputs = before = static_cast<size_t>(weight->shape[1]);
    ANCHORSPLAT_ASSIGN_OR_RETURN(layer.weights, ReadAll(file, name, weight->shape));
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        layer.bias, ReadAll(file, Cat("layer", k, ".bias"), std::array{weight->shape[0], weight->shape[1]}));
  }
  if (before != kPredictionValues) {
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": says ", before, " values of a splat, not ", kPredictionValues)};
  }
  return model;
}

const ReadingModel& ReadingModel::Shipped() {
  static const ReadingModel model = [] {
    Buffer<std::byte> bytes(anchorsplat_reading_model, anchorsplat_reading_model_end);
    const auto file = TensorFile::FromBytes(std::move(bytes), "models/reading.safetensors");
    return *Load(*file);  // a test verifies that it loads
  }();
  return model;
}

std::string ReadingModel::ShippedIdentity() {
  Fingerprint print;
  print.Add(std::span(anchorsplat_reading_model, anchorsplat_reading_model_end));
  return print.text();
}

std::vector<float> ReadingModel::Scaled(std::span<const double> features) const {
  std::vector<float> scaled(mean_.size());
  for (size_t k = 0; k < scaled.size(); ++k) {
    const float z = (static_cast<float>(features[k]) - mean_[k]) / deviation_[k];
    scaled[k] = std::isnan(z) ? 0 : z;  // unknown features get the mean
  }
  return scaled;
}

std::vector<ReadingPrediction> ReadingModel::Predict(std::span<const double> features) const {
  std::vector<float> first = Scaled(features);
  for (float& z : first) z = std::clamp(z, -kMostDeviations, kMostDeviations);
  std::vector<ReadingPrediction> predictions;
  for (size_t member = 0; member < members_; ++member) {
    std::vector<float> values = first;
    for (size_t k = 0; k < layers_.size(); ++k) {
      const Layer& layer = layers_[k];
      const float* const weights = layer.weights.data() + member * layer.outputs * layer.inputs;
      std::vector<float> next(layer.outputs);
      for (size_t o = 0; o < layer.outputs; ++o) {
        float sum = layer.bias[member * layer.outputs + o];
        for (size_t i = 0; i < layer.inputs; ++i) sum += weights[o * layer.inputs + i] * values[i];
        next[o] = k + 1 < layers_.size() ? Silu(sum) : sum;
      }
      values = std::move(next);
    }
    predictions.push_back(PredictionFrom(values));
  }
  return predictions;
}

double ReadingModel::Strangeness(std::span<const double> features) const {
  double squares = 0;
  const std::vector<float> scaled = Scaled(features);
  for (const float z : scaled) squares += std::min(100.0, double{z} * double{z});
  return std::sqrt(squares / static_cast<double>(scaled.size())) / farthest_;
}

}  // namespace anchorsplat

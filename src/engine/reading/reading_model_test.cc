#include "reading/reading_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/random.h"
#include "io/folder_for_test.h"
#include "reading/features.h"
#include "tensors/safetensors.h"

namespace anchorsplat {
namespace {

constexpr int64_t kMembers = 2, kHidden = 5, kOutputs = 2 + 8 + 2 * 6 * 7;

struct Weights {
  std::map<std::string, std::pair<std::vector<int64_t>, std::vector<float>>> tensors;
  std::string names, outputs = "pixel provenance gains losses";

  Weights() {
    Random random(7);
    const auto inputs = static_cast<int64_t>(FeatureNames().size());
    const auto add = [&](const std::string& name, std::vector<int64_t> shape, double size) {
      int64_t count = 1;
      for (const int64_t side : shape) count *= side;
      std::vector<float> values;
      for (int64_t i = 0; i < count; ++i) values.push_back(static_cast<float>(size * random.Normal()));
      tensors[name] = {std::move(shape), std::move(values)};
    };
    add("mean", {inputs}, 1);
    add("deviation", {inputs}, 0);
    for (float& x : tensors["deviation"].second) x = 0.5f + static_cast<float>(random.Uniform());
    tensors["calibration"] = {{3}, {1.5f, 2.0f, 0.25f}};
    add("layer0.weight", {kMembers, kHidden, inputs}, 0.1);
    add("layer0.bias", {kMembers, kHidden}, 1);
    add("layer1.weight", {kMembers, kHidden, kHidden}, 0.5);
    add("layer1.bias", {kMembers, kHidden}, 1);
    add("layer2.weight", {kMembers, kOutputs, kHidden}, 0.5);
    add("layer2.bias", {kMembers, kOutputs}, 1);
    for (const std::string& name : FeatureNames()) names += (names.empty() ? "" : " ") + name;
  }

  Result<ReadingModel> Load(const std::filesystem::path& path) const {
    std::vector<TensorEntry> entries;
    for (const auto& [name, tensor] : tensors) entries.push_back(MakeEntry(name, tensor.first, tensor.second));
    const Status written =
        WriteSafetensors(path, entries, {{"features", names}, {"outputs", outputs}}, {.overwrite = true});
    if (!written.ok()) return written.error();
    ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
    return ReadingModel::Load(file);
  }
};

class ReadingModelTest : public testing::Test {
 protected:
  TestFolder folder_;
};

// As the formulas have it.
std::vector<double> PlainReference(const Weights& weights, size_t member, const std::vector<double>& features) {
  std::vector<double> values;
  for (size_t k = 0; k < features.size(); ++k) {
    const double z = (features[k] - double{weights.tensors.at("mean").second[k]}) /
                     double{weights.tensors.at("deviation").second[k]};
    values.push_back(std::isnan(z) ? 0 : std::min(4.0, std::max(-4.0, z)));
  }
  for (int layer = 0; layer < 3; ++layer) {
    const auto& [shape, weight] = weights.tensors.at("layer" + std::to_string(layer) + ".weight");
    const auto& bias = weights.tensors.at("layer" + std::to_string(layer) + ".bias").second;
    const auto outputs = static_cast<size_t>(shape[1]), inputs = static_cast<size_t>(shape[2]);
    std::vector<double> next;
    for (size_t o = 0; o < outputs; ++o) {
      double sum = double{bias[member * outputs + o]};
      for (size_t i = 0; i < inputs; ++i) sum += double{weight[(member * outputs + o) * inputs + i]} * values[i];
      next.push_back(layer < 2 ? sum / (1 + std::exp(-sum)) : sum);
    }
    values = next;
  }
  return values;
}

TEST_F(ReadingModelTest, SaysWhatThePlainReferenceSays) {
  const Weights weights;
  const auto model = weights.Load(folder_ / "model.safetensors");
  ASSERT_TRUE(model.ok()) << model.error().message;
  EXPECT_DOUBLE_EQ(model->interval(), 1.5);
  Random random(3);
  std::vector<double> features(FeatureNames().size());
  for (double& x : features) x = 3 * random.Normal();
  features[5] = std::nan("");
  const auto predictions = model->Predict(features);
  ASSERT_EQ(predictions.size(), static_cast<size_t>(kMembers));
  for (size_t member = 0; member < predictions.size(); ++member) {
    const std::vector<double> expected = PlainReference(weights, member, features);
    const ReadingPrediction& said = predictions[member];
    EXPECT_NEAR(said.log_pixel, expected[0], 1e-4);
    EXPECT_NEAR(said.log_spread, std::clamp(expected[1], -3.5, 1.0), 1e-4);
    for (size_t k = 0; k < kProvenanceCount; ++k) EXPECT_NEAR(said.logits[k], expected[2 + k], 1e-4);
    for (size_t t = 0; t < kGainCount; ++t) {
      for (size_t k = 0; k < 7; ++k) {
        EXPECT_NEAR(said.gains[t][k], expected[10 + 7 * t + k], 1e-4);
        EXPECT_NEAR(said.losses[t][k], std::log(1 + std::exp(expected[10 + 42 + 7 * t + k])), 1e-4);
      }
    }
  }
  EXPECT_GT(model->Strangeness(features), 0);
}

TEST_F(ReadingModelTest, RefusesOtherFeaturesAndShapes) {
  Weights weights;
  weights.names += " more";
  EXPECT_EQ(weights.Load(folder_ / "a.safetensors").error().code, ErrorCode::kBadFile);
  Weights of_deviations;  // as before there were losses, of the same shapes
  of_deviations.outputs = "pixel provenance gains deviations";
  EXPECT_EQ(of_deviations.Load(folder_ / "a.safetensors").error().code, ErrorCode::kBadFile);
  for (const auto& [name, tensor] : Weights().tensors) {
    Weights without;
    without.tensors.erase(name);
    EXPECT_EQ(without.Load(folder_ / "b.safetensors").error().code, ErrorCode::kBadFile) << name;
    Weights longer;
    longer.tensors[name].first[0] += 1;
    longer.tensors[name].second.resize(2 * tensor.second.size());
    int64_t count = 1;
    for (const int64_t side : longer.tensors[name].first) count *= side;
    longer.tensors[name].second.resize(static_cast<size_t>(count));
    EXPECT_EQ(longer.Load(folder_ / "c.safetensors").error().code, ErrorCode::kBadFile) << name;
  }
}

}  // namespace
}  // namespace anchorsplat

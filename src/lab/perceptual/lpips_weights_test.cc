#include "perceptual/lpips_weights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <limits>

#include "core/image.h"
#include "core/text.h"
#include "io/folder_for_test.h"
#include "perceptual/lpips.h"
#include "perceptual/lpips_synthetic_for_test.h"
#include "tensors/safetensors.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

struct NamedTensor {
  std::string name;
  std::vector<int64_t> shape;
  Buffer<float> values;
};

// The synthetic weights of a network under their names.
std::vector<NamedTensor> Named(LpipsNet net) {
  std::vector<NamedTensor> tensors;
  LpipsWeights weights = SyntheticLpipsWeights(net);
  const std::vector<LpipsTensorSpec> specs = LpipsTensors(net);
  for (size_t i = 0; i < specs.size(); ++i) {
    tensors.push_back({specs[i].name, specs[i].shape, std::move(weights.tensors[i])});
  }
  return tensors;
}

void Write(const std::filesystem::path& path, const std::vector<NamedTensor>& tensors) {
  std::vector<TensorEntry> entries;
  entries.reserve(tensors.size());
  for (const NamedTensor& tensor : tensors) entries.push_back(MakeEntry(tensor.name, tensor.shape, tensor.values));
  const Status written = WriteSafetensors(path, entries, {});
  ASSERT_TRUE(written.ok()) << written.error().message;
}

TEST(LpipsWeights, ReadsOneFileAndThePublishersTwo) {
  const TestFolder folder;
  std::vector<NamedTensor> tensors = Named(LpipsNet::kSqueeze);
  Write(folder / "squeeze.safetensors", tensors);
  const auto whole = ReadLpipsWeights(LpipsNet::kSqueeze, folder.path());
  ASSERT_TRUE(whole.ok()) << whole.error().message;

  // A backbone saved as `features` alone, and one with the classifier's head as torchvision saves it. What a file is
  // decides its content, not its name.
  std::vector<NamedTensor> backbone, heads;
  for (const NamedTensor& tensor : tensors) (tensor.name.starts_with("lin") ? heads : backbone).push_back(tensor);
  for (const bool alone : {false, true}) {
    const TestFolder pair;
    std::vector<NamedTensor> saved = backbone;
    if (alone) {
      for (NamedTensor& tensor : saved) tensor.name = tensor.name.substr(std::string("features.").size());
    } else {
      saved.push_back({"classifier.1.bias", {3}, Buffer<float>(3, 1.0f)});
    }
    Write(pair / "squeeze.backbone.pth", saved);
    Write(pair / "squeeze.heads.pth", heads);
    const auto two = ReadLpipsWeights(LpipsNet::kSqueeze, pair.path());
    ASSERT_TRUE(two.ok()) << two.error().message;
    EXPECT_EQ(two->tensors, whole->tensors);
  }
}

TEST(LpipsWeights, SaysWhatIsMissingOrWrong) {
  const TestFolder folder;
  const auto missing = ReadLpipsWeights(LpipsNet::kAlex, folder.path());
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(missing.error().message, HasSubstr("scripts/fetch-lpips.sh"));

  const auto message = [](LpipsNet net, const std::vector<NamedTensor>& tensors) {
    const TestFolder other;
    Write(other / Cat(LpipsNetName(net), ".safetensors"), tensors);
    const auto read = ReadLpipsWeights(net, other.path());
    return read.ok() ? std::string("read") : read.error().message;
  };
  std::vector<NamedTensor> tensors = Named(LpipsNet::kAlex);
  EXPECT_EQ(message(LpipsNet::kAlex, tensors), "read");
  EXPECT_THAT(message(LpipsNet::kVgg, tensors), HasSubstr("\"features.0.weight\" has the shape [64, 3, 11, 11]"));
  tensors.back().values[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(message(LpipsNet::kAlex, tensors), HasSubstr("lin4.model.1.weight"));
  tensors.pop_back();
  EXPECT_THAT(message(LpipsNet::kAlex, tensors), HasSubstr("no tensor \"lin4.model.1.weight\""));

  std::ofstream(folder / "vgg.safetensors") << "not a tensor file at all";
  const auto broken = ReadLpipsWeights(LpipsNet::kVgg, folder.path());
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.error().code, ErrorCode::kBadFile);
}

TEST(LpipsWeights, WithoutThePluginTheProgramSaysSo) {
  const auto opened = Lpips::Open(SyntheticLpipsWeights(LpipsNet::kAlex), "/nowhere/anchorsplat-lpips.so");
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(opened.error().message, HasSubstr("LPIPS missing"));
}

TEST(LpipsNet, NamesAndSizes) {
  for (const LpipsNet net : {LpipsNet::kAlex, LpipsNet::kVgg, LpipsNet::kSqueeze}) {
    EXPECT_EQ(FindLpipsNet(LpipsNetName(net)), net);
  }
  EXPECT_EQ(FindLpipsNet("alexnet"), std::nullopt);
  // By hand: VGG halves four times; AlexNet's last pool needs 3, so 7, so (7 − 1)·4 + 11 − 4.
  EXPECT_EQ(SmallestLpipsSide(LpipsNet::kVgg), 16);
  EXPECT_EQ(SmallestLpipsSide(LpipsNet::kAlex), 31);
  EXPECT_EQ(LpipsTensors(LpipsNet::kAlex).size(), 15u);
  EXPECT_EQ(LpipsTensors(LpipsNet::kVgg).size(), 31u);
  EXPECT_EQ(LpipsTensors(LpipsNet::kSqueeze).size(), 2u + 8 * 6 + 7);
}

}  // namespace
}  // namespace anchorsplat

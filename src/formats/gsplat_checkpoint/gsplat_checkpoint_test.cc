#include "formats/gsplat_checkpoint/gsplat_checkpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/source_dir_for_test.h"
#include "core/spherical_harmonics.h"
#include "tensors/tensor_bytes_for_test.h"
#include "tensors/tensor_entry.h"

namespace anchorsplat {
namespace {

using namespace testing;       // NOLINT: matchers
using namespace tensor_bytes;  // NOLINT: builders

float Ramp(int t, int64_t i) { return static_cast<float>(t) + static_cast<float>(i) / 16; }

Result<GaussianCloud> Read(const std::string& bytes, const ReadLimits& limits = {}) {
  return ReadGsplatCheckpoint(InputFile::FromBytes("x.pt", bytes), limits);
}

// A checkpoint of one Gaussian; every tensor has the same storage of 64 zeros.
std::string OneGaussian(const std::vector<std::pair<std::string, std::vector<int64_t>>>& shapes) {
  std::vector<std::pair<std::string, std::string>> members;
  for (const auto& [name, shape] : shapes) members.emplace_back(name, Tensor(shape, RowMajorStrides(shape), 0, 64));
  return MakeCheckpoint(Pickle(Dict({{"splats", Dict(members)}})), std::string(256, '\0'));
}

TEST(GsplatCheckpoint, ReadsEveryDegreeThroughTheDoor) {
  for (const int degree : {0, 1, 3}) {
    const auto path = SourceDirForTest().string() + "/testdata/tensors/ckpt_degree" + std::to_string(degree) + ".pt";
    const Result<GaussianCloud> cloud = ReadCloud(path);
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_TRUE(Validate(*cloud).ok());
    ASSERT_EQ(cloud->size(), 5);
    EXPECT_EQ(cloud->sh_degree, degree);
    EXPECT_FALSE(cloud->render_mode.has_value());
    const int64_t rest = cloud->sh_stride() - 3;
    for (int64_t i = 0; i < 5; ++i) {
      for (int64_t a = 0; a < 3; ++a) {
        EXPECT_EQ(cloud->means[static_cast<size_t>(3 * i + a)], Ramp(0, 3 * i + a));
        EXPECT_EQ(cloud->log_scales[static_cast<size_t>(3 * i + a)], Ramp(1, 3 * i + a));
        EXPECT_EQ(cloud->sh[static_cast<size_t>(cloud->sh_stride() * i + a)], Ramp(4, 3 * i + a));
      }
      for (int64_t a = 0; a < 4; ++a) EXPECT_EQ(cloud->quats[static_cast<size_t>(4 * i + a)], Ramp(2, 4 * i + a));
      EXPECT_EQ(cloud->opacity_logits[static_cast<size_t>(i)], Ramp(3, i));
      for (int64_t a = 0; a < rest; ++a) {
        EXPECT_EQ(cloud->sh[static_cast<size_t>(cloud->sh_stride() * i + 3 + a)], Ramp(5, rest * i + a));
      }
    }
  }
}

TEST(GsplatCheckpoint, ReadsSplatfactos) {
  for (const std::string prefix : {"_model.gauss_params.", "_model."}) {
    for (const int64_t rest : {0, 3}) {
      // Every tensor begins at a number of its own in a storage of 64 ramping ones.
      std::vector<std::pair<std::string, std::string>> members;
      int64_t at = 0;
      for (const auto& [name, shape] :
           std::vector<std::pair<std::string, std::vector<int64_t>>>{{"means", {1, 3}},
                                                                     {"scales", {1, 3}},
                                                                     {"quats", {1, 4}},
                                                                     {"features_dc", {1, 3}},
                                                                     {"features_rest", {1, rest, 3}},
                                                                     {"opacities", {1, 1}}}) {
        members.emplace_back(prefix + name, Tensor(shape, RowMajorStrides(shape), at, 64));
        at += 3;
      }
      std::string storage;
      for (int i = 0; i < 64; ++i) {
        const float value = Ramp(0, i);
        storage.append(reinterpret_cast<const char*>(&value), sizeof value);
      }
      const auto cloud = Read(MakeCheckpoint(Pickle(Dict({{"pipeline", Dict(members)}})), storage));
      ASSERT_TRUE(cloud.ok()) << cloud.error().message;
      EXPECT_EQ(cloud->sh_degree, rest == 0 ? 0 : 1);
      EXPECT_THAT(cloud->means, ElementsAre(Ramp(0, 0), Ramp(0, 1), Ramp(0, 2)));
      EXPECT_THAT(cloud->log_scales, ElementsAre(Ramp(0, 3), Ramp(0, 4), Ramp(0, 5)));
      EXPECT_EQ(cloud->quats[0], Ramp(0, 6));
      EXPECT_EQ(cloud->opacity_logits[0], Ramp(0, 15));
      if (rest == 0) {
        EXPECT_NEAR(ColorFromDc(cloud->sh[0]), 1 / (1 + std::exp(-Ramp(0, 9))), 1e-6) << "the logit of a colour";
      } else {
        EXPECT_EQ(cloud->sh[0], Ramp(0, 9));
        EXPECT_EQ(cloud->sh[3], Ramp(0, 12));
      }
    }
  }
}

TEST(GsplatCheckpoint, MessagesNameTheTensor) {
  const std::vector<std::pair<std::string, std::vector<int64_t>>> good = {{"means", {1, 3}},  {"scales", {1, 3}},
                                                                          {"quats", {1, 4}},  {"opacities", {1}},
                                                                          {"sh0", {1, 1, 3}}, {"shN", {1, 8, 3}}};
  ASSERT_TRUE(Read(OneGaussian(good)).ok());
  EXPECT_EQ(Read(OneGaussian(good))->sh_degree, 2);
  for (size_t i = 0; i < good.size(); ++i) {
    auto broken = good;
    broken[i].second.back() += 1;
    const Result<GaussianCloud> cloud = Read(OneGaussian(broken));
    ASSERT_FALSE(cloud.ok()) << good[i].first;
    EXPECT_EQ(cloud.error().code, ErrorCode::kBadFile);
    EXPECT_THAT(cloud.error().message, StartsWith("x.pt: tensor \"splats." + good[i].first + "\" has shape "));
    broken = good;
    broken.erase(broken.begin() + static_cast<ptrdiff_t>(i));
    EXPECT_THAT(Read(OneGaussian(broken)).error().message,
                HasSubstr("\"" + std::string(i == 0 ? "" : "splats.") + good[i].first + "\""));
  }
  auto wide = good;
  wide.back().second[1] = 9;
  EXPECT_THAT(Read(OneGaussian(wide)).error().message, HasSubstr("has shape [1, 9, 3], expected [N, 0, 3], [N, 3, 3]"));
  EXPECT_THAT(Read(ReadTestFile("ckpt_degree1.pt"), {.max_gaussians = 4}).error().message,
              HasSubstr("holds 5 Gaussians, more than the limit of 4"));
  EXPECT_THAT(Read(ReadTestFile("state_dict.pth")).error().message, HasSubstr("but neither one of gsplat"));
}

TEST(GsplatCheckpoint, AClaimedNumberOfGaussiansIsNotBelieved) {
  // An empty tensor may have any number of rows; nothing is allocated for them.
  const Result<GaussianCloud> cloud = Read(OneGaussian({{"means", {int64_t{1} << 28, 0}}, {"shN", {1, 15, 3}}}));
  EXPECT_THAT(cloud.error().message, HasSubstr("has shape [268435456, 0], expected [268435456, 3]"));
}

TEST(GsplatCheckpoint, AnEmptyCheckpointIsAnError) {
  EXPECT_THAT(Read(OneGaussian({{"means", {0, 3}}})).error().message, HasSubstr("x.pt: holds no Gaussians"));
}

TEST(GsplatCheckpoint, IsRecognisedByContent) {
  EXPECT_TRUE(IsTorchCheckpoint(ReadTestFile("ckpt_degree0.pt")));
  EXPECT_TRUE(IsTorchCheckpoint(ReadTestFile("legacy.pth")));
  EXPECT_FALSE(IsTorchCheckpoint(MakeZip({{"meta.json", "{}"}}))) << "another format's zip archive";
  EXPECT_FALSE(IsTorchCheckpoint("ply\n"));
  EXPECT_FALSE(IsTorchCheckpoint(""));
}

}  // namespace
}  // namespace anchorsplat

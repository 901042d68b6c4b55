#include "formats/gsplat_checkpoint/gsplat_checkpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/messages_for_test.h"
#include "core/source_dir_for_test.h"
#include "core/spherical_harmonics.h"
#include "formats/opened_splat.h"
#include "io/atomic_file.h"
#include "io/folder_for_test.h"
#include "io/input_record.h"
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

// A number of NumPy's as protocol 2 has it.
std::string NumpyNumber() {
  const std::string bytes = "c_codecs\nencode\n" + Tuple({Text("01234567"), Text("latin1")}) + "R";
  const std::string type = "cnumpy\ndtype\n" + Tuple({Text("f8"), "\x89", "\x88"}) + "R" +
                           Tuple({Int(3), Text("<"), "N", "N", "N", Int(-1), Int(-1), Int(0)}) + "b";
  return "cnumpy.core.multiarray\nscalar\n" + Tuple({type, bytes}) + "R";
}

// What gaussians.capture() of INRIA's trainer gives of one Gaussian: every tensor begins at a number of its own in a
// storage of 64 ramping ones.
std::string Captured(int64_t rest, int64_t scales) {
  const auto tensor = [](std::vector<int64_t> shape, int64_t at) {
    return Tensor(shape, RowMajorStrides(shape), at, 64);
  };
  const std::string group = Dict({{"lr", NumpyNumber()}, {"name", Text("xyz")}, {"params", "](" + Int(0) + "e"}});
  const std::string state = "}(" + Int(0) + Dict({{"step", tensor({}, 0)}, {"exp_avg", tensor({1, 3}, 0)}}) + "u";
  return Tuple({Int(3), tensor({1, 3}, 0), tensor({1, 1, 3}, 3), tensor({1, rest, 3}, 6), tensor({1, scales}, 51),
                tensor({1, 4}, 54), tensor({1, 1}, 58), tensor({1}, 0), tensor({1, 1}, 0), tensor({1, 1}, 0),
                Dict({{"state", state}, {"param_groups", "](" + group + "e"}}), NumpyNumber()});
}

std::string RampStorage() {
  std::string storage;
  for (int i = 0; i < 64; ++i) {
    const float value = Ramp(0, i);
    storage.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return storage;
}

TEST(GsplatCheckpoint, ReadsInrias) {
  for (const int64_t rest : {0, 3, 15}) {
    for (const int64_t scales : {3, 2}) {
      const std::string captured = Captured(rest, scales);
      for (const std::string& saved : {Tuple({captured, Int(30000)}), captured}) {
        const auto cloud = Read(MakeCheckpoint(Pickle(saved), RampStorage()));
        ASSERT_TRUE(cloud.ok()) << cloud.error().message;
        EXPECT_EQ(cloud->sh_degree, rest == 0 ? 0 : rest == 3 ? 1 : 3);
        EXPECT_THAT(cloud->means, ElementsAre(Ramp(0, 0), Ramp(0, 1), Ramp(0, 2)));
        EXPECT_EQ(cloud->sh[0], Ramp(0, 3));
        if (rest > 0) {
          EXPECT_EQ(cloud->sh[3], Ramp(0, 6));
        }
        EXPECT_EQ(cloud->log_scales[1], Ramp(0, 52));
        const float third = scales == 3 ? Ramp(0, 53) : -std::numeric_limits<float>::infinity();
        EXPECT_EQ(cloud->log_scales[2], third);
        EXPECT_EQ(cloud->quats[0], Ramp(0, 54));
        EXPECT_EQ(cloud->opacity_logits[0], Ramp(0, 58));
      }
    }
  }
  // Numbers as names alone are no splat: a list of layers.
  EXPECT_THAT(Read(MakeCheckpoint(Pickle(Tuple({Tensor({2}, {1}), Tensor({2}, {1})})))).error().message,
              HasSubstr("or INRIA's trainer"));
}

TEST(GsplatCheckpoint, PartsOfOneSplatAreReadTogether) {
  const TestFolder folder;
  const auto put = [&](const std::string& name, int degree) {
    ASSERT_TRUE(WriteWholeFile(folder / name, ReadTestFile("ckpt_degree" + std::to_string(degree) + ".pt"), true).ok());
  };
  put("ckpt_9_rank0.pt", 1);
  put("ckpt_8_rank1.pt", 0);  // of another step
  const auto alone = ReadCloud(folder / "ckpt_9_rank0.pt");
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  put("ckpt_9_rank1.pt", 1);
  put("ckpt_9_rank2.pt", 1);
  const InputRecord record;
  for (const char* name : {"ckpt_9_rank0.pt", "ckpt_9_rank2.pt"}) {
    const Messages messages;
    const auto all = ReadCloud(folder / name);
    ASSERT_TRUE(all.ok()) << all.error().message;
    EXPECT_EQ(all->size(), 15);
    EXPECT_EQ(all->means[15], all->means[0]);
    ASSERT_EQ(messages.notes().size(), 1u);
    EXPECT_THAT(
        messages.notes()[0],
        HasSubstr("reading all 3 parts of this splat (ckpt_9_rank0.pt to ckpt_9_rank2.pt); to read it alone, rename"));
  }
  EXPECT_FALSE(CheckNotInput(folder / "ckpt_9_rank1.pt").ok());
  EXPECT_EQ(OpenedSplat::Open(folder / "ckpt_9_rank0.pt")->bytes(), 3 * ReadTestFile("ckpt_degree1.pt").size());
  put("ckpt_9_rank4.pt", 1);
  EXPECT_THAT(ReadCloud(folder / "ckpt_9_rank0.pt").error().message,
              HasSubstr("is one part of a splat, but ckpt_9_rank3.pt is missing beside it"));
  EXPECT_THAT(ReadCloud(folder / "ckpt_8_rank1.pt").error().message, HasSubstr("ckpt_8_rank0.pt is missing"));
  put("ckpt_9_rank3.pt", 3);
  EXPECT_THAT(ReadCloud(folder / "ckpt_9_rank0.pt").error().message,
              HasSubstr("ckpt_9_rank0.pt has SH degree 1 and ckpt_9_rank3.pt has 3"));
  put("one.pt", 1);
  EXPECT_EQ(ReadCloud(folder / "one.pt")->size(), 5);
}

// Of one Gaussian, at a step.
std::string AtStep(int step) {
  std::vector<std::pair<std::string, std::string>> members;
  for (const auto& [name, shape] : std::vector<std::pair<std::string, std::vector<int64_t>>>{{"means", {1, 3}},
                                                                                             {"scales", {1, 3}},
                                                                                             {"quats", {1, 4}},
                                                                                             {"opacities", {1}},
                                                                                             {"sh0", {1, 1, 3}},
                                                                                             {"shN", {1, 0, 3}}}) {
    members.emplace_back(name, Tensor(shape, RowMajorStrides(shape), 0, 64));
  }
  return MakeCheckpoint(Pickle(Dict({{"step", Int(step)}, {"splats", Dict(members)}})), RampStorage());
}

TEST(GsplatCheckpoint, PartsOfDifferentStepsAreNotMixed) {
  const TestFolder folder;
  ASSERT_TRUE(WriteWholeFile(folder / "ckpt_9_rank0.pt", AtStep(29999), true).ok());
  ASSERT_TRUE(WriteWholeFile(folder / "ckpt_9_rank1.pt", AtStep(29999), true).ok());
  EXPECT_EQ(ReadCloud(folder / "ckpt_9_rank0.pt")->size(), 2);
  ASSERT_TRUE(WriteWholeFile(folder / "ckpt_9_rank1.pt", AtStep(6), true).ok());
  for (const char* name : {"ckpt_9_rank0.pt", "ckpt_9_rank1.pt"}) {
    EXPECT_THAT(ReadCloud(folder / name).error().message,
                HasSubstr("ckpt_9_rank0.pt has step 29999 and ckpt_9_rank1.pt has 6"));
  }
}

TEST(GsplatCheckpoint, MeansInDoubleAreWorldCoordinates) {
  for (const double far : {0.0, 4500000.0}) {
    const std::vector<double> world = {far + 12.125, 17.0625, 120.5, far + 13.015625, 16.0, 121.0};
    std::string doubles;
    for (const double value : world) doubles += Little(value);
    for (int i = 6; i < 64; ++i) doubles += Little(-5.0);
    std::vector<std::pair<std::string, std::string>> members;
    for (const auto& [name, shape] : std::vector<std::pair<std::string, std::vector<int64_t>>>{{"means", {2, 3}},
                                                                                               {"scales", {2, 3}},
                                                                                               {"quats", {2, 4}},
                                                                                               {"opacities", {2}},
                                                                                               {"sh0", {2, 1, 3}},
                                                                                               {"shN", {2, 0, 3}}}) {
      members.emplace_back(name, Tensor(shape, RowMajorStrides(shape), name == "means" ? 0 : 6, 64, "DoubleStorage"));
    }
    const auto cloud = Read(MakeCheckpoint(Pickle(Dict({{"splats", Dict(members)}})), doubles));
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_EQ(IsZero(cloud->origin), far == 0);
    EXPECT_EQ(cloud->double_means, far > 0);
    for (int64_t i = 0; i < 6; ++i) {
      const auto at = ToWorld(cloud->means.data() + i - i % 3, cloud->origin);
      EXPECT_EQ(at[static_cast<size_t>(i % 3)], world[static_cast<size_t>(i)]);
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
  EXPECT_THAT(Read(ReadTestFile("state_dict.pth")).error().message, HasSubstr("but not of gsplat"));
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

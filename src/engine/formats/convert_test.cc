#include "formats/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/messages_for_test.h"
#include "core/random.h"
#include "core/spherical_harmonics.h"
#include "core/splat_comments.h"
#include "core/world_up.h"
#include "formats/opened_splat.h"
#include "formats/ply/ply_writer.h"
#include "formats/random_cloud_for_test.h"
#include "formats/registry.h"
#include "formats/splat_order.h"
#include "io/atomic_file.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "io/input_record.h"

namespace anchorsplat {
namespace {

std::filesystem::path Ply(const TestFolder& folder, const GaussianCloud& cloud) {
  EXPECT_TRUE(WritePly(folder / "in.ply", cloud, {.overwrite = true}).ok());
  return folder / "in.ply";
}

TEST(Convert, ToEveryFormatAndBack) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(2000, 2, 3);
  for (float& x : cloud.log_scales) x -= 4;
  for (float& x : cloud.sh) x *= 0.3f;
  const auto input = Ply(folder, cloud);
  int written = 0;
  for (const SplatFormat& format : Formats()) {
    if (format.write == nullptr) continue;
    const std::string extension(format.extensions[0]);
    const auto output = extension.starts_with('.') ? folder / ("out" + extension) : folder / "scene" / extension;
    const auto report = ConvertFile(input, output, {.measure = true});
    ASSERT_TRUE(report.ok()) << report.error().message;
    ++written;
    EXPECT_EQ(report->output_format, format.name);
    EXPECT_EQ(report->gaussians_written, 2000);
    uint64_t bytes = std::filesystem::file_size(output);
    if (extension == ".gltf") bytes += std::filesystem::file_size(folder / "out.bin");
    if (format.several_files) {
      bytes = 0;
      for (const auto& file : std::filesystem::recursive_directory_iterator(output.parent_path())) {
        if (file.is_regular_file()) bytes += file.file_size();
      }
    }
    EXPECT_EQ(report->output_bytes, bytes);
    EXPECT_EQ(report->sh_degree_written, format.range.sh_degree == 0 ? 0 : 2) << format.name;
    if (report->predicted_roughly) {
      EXPECT_NEAR(static_cast<double>(*report->predicted_bytes), static_cast<double>(report->output_bytes),
                  0.6 * static_cast<double>(report->output_bytes))
          << format.name;
    } else {
      EXPECT_EQ(report->predicted_bytes.value_or(report->output_bytes), report->output_bytes) << format.name;
    }
    ASSERT_EQ(report->error.has_value(), format.read != nullptr) << format.name;
    if (!report->error) continue;
    EXPECT_EQ(report->error->compared, 2000) << format.name;
    EXPECT_LT(report->error->means.max, 0.01) << format.name;
    EXPECT_LT(report->error->log_scales.rms, 0.03) << format.name;
    EXPECT_LT(report->error->rotations.max, 0.05) << format.name;
    EXPECT_LT(report->error->opacities.max, 0.003) << format.name;
  }
  EXPECT_GE(written, 7);
}

TEST(Convert, DropsLowersAndKeepsTheOrder) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(1000, 3, 3);
  GaussianCloud kept;
  const auto report = ConvertFile(Ply(folder, cloud), folder / "out.ply",
                                  {.sh_degree = 1, .min_opacity = 0.5f, .max_gaussians = 100}, &kept);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->gaussians_read, 1000);
  EXPECT_EQ(report->gaussians_written, 100);
  EXPECT_EQ(report->sh_degree_read, 3);
  EXPECT_EQ(report->sh_degree_written, 1);
  ASSERT_EQ(kept.size(), 100);
  const auto importance = [](const GaussianCloud& c, size_t i) {
    return c.log_scales[3 * i] + c.log_scales[3 * i + 1] + c.log_scales[3 * i + 2] -
           std::log1p(std::exp(-c.opacity_logits[i]));
  };
  float least = INFINITY;
  size_t source = 0;
  for (size_t i = 0; i < 100; ++i) {
    while (source < 1000 && cloud.means[3 * source] != kept.means[3 * i]) ++source;  // in the old order
    ASSERT_LT(source, 1000u);
    EXPECT_GE(kept.opacity_logits[i], 0);
    for (size_t k = 0; k < 12; ++k) EXPECT_EQ(kept.sh[12 * i + k], cloud.sh[48 * source + k]);
    EXPECT_EQ(kept.quats[4 * i + 3], cloud.quats[4 * source + 3]);
    least = std::min(least, importance(kept, i));
  }
  int64_t better = 0;
  for (size_t i = 0; i < 1000; ++i) better += cloud.opacity_logits[i] >= 0 && importance(cloud, i) > least + 1e-4f;
  EXPECT_LT(better, 100);
  const auto nothing = ConvertFile(Ply(folder, cloud), folder / "none.ply", {.min_opacity = 1.0f});
  EXPECT_EQ(nothing.error().code, ErrorCode::kBadArgument);
}

TEST(Convert, RaisesTheDegree) {
  GaussianCloud cloud = RandomCloud(10, 1, 3);
  const GaussianCloud before = cloud;
  SetShDegree(cloud, 3);
  ExpectSameCloud(cloud, WithShDegree(before, 3));
  SetShDegree(cloud, 1);
  ExpectSameCloud(cloud, before);
  SetShDegree(cloud, 0);
  ExpectSameCloud(cloud, WithShDegree(before, 0));
}

TEST(Convert, ReorderIsSubset) {
  GaussianCloud cloud = RandomCloud(500, 1, 3);
  const Buffer<uint32_t> rows = MortonOrder(cloud);
  const std::vector<int64_t> wide(rows.begin(), rows.end());
  const GaussianCloud expected = *Subset(cloud, wide);
  Reorder(cloud, rows);
  ExpectSameCloud(cloud, expected);
}

TEST(Convert, SortsWhatKeepsItsOrderByItself) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(500, 0, 3);
  ConvertOptions options;
  options.write.order = SplatOrder::kImportance;
  ASSERT_TRUE(ConvertFile(Ply(folder, cloud), folder / "out.ply", options).ok());
  const Buffer<uint32_t> rows = ImportanceOrder(cloud);
  const GaussianCloud sorted = *ReadCloud(folder / "out.ply");
  for (size_t i = 0; i < 500; ++i) EXPECT_EQ(sorted.means[3 * i], cloud.means[3 * rows[i]]);
}

TEST(Convert, AxesOfFilesThatDoNotFollowTheirFormat) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(50, 1, 3);
  ConvertOptions options;
  ASSERT_TRUE(ParseAxes(":RDF", options).ok());
  // An SPZ that holds RDF, as careless programs write it, read as what it is.
  ASSERT_TRUE(ConvertFile(Ply(folder, cloud), folder / "rdf.spz", options).ok());
  EXPECT_NEAR(ReadCloud(folder / "rdf.spz")->means[1], -cloud.means[1], 1e-3);
  options = {};
  ASSERT_TRUE(ParseAxes("rdf", options).ok());
  ASSERT_TRUE(ConvertFile(folder / "rdf.spz", folder / "back.ply", options).ok());
  const GaussianCloud back = *ReadCloud(folder / "back.ply");
  EXPECT_LT(CompareAttributes(back, cloud)->means.max, 1e-3);
  EXPECT_LT(CompareAttributes(back, cloud)->rotations.max, 0.01);
  for (const char* bad : {"", ":", "XYZ", "RDF:abc", "RDF:RUB:LUF", "RLF:"})
    EXPECT_FALSE(ParseAxes(bad, options).ok()) << bad;
}

TEST(Convert, AxesInAnyOrder) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(50, 3, 3);
  ConvertOptions options;
  ASSERT_TRUE(ParseAxes(":rfu", options).ok());
  ASSERT_TRUE(ConvertFile(Ply(folder, cloud), folder / "rfu.ply", options).ok());
  const GaussianCloud written = *ReadCloud(folder / "rfu.ply");
  for (size_t i = 0; i < 50; ++i) {
    EXPECT_EQ(written.means[3 * i + 1], cloud.means[3 * i + 2]);
    EXPECT_EQ(written.means[3 * i + 2], -cloud.means[3 * i + 1]);
  }
  // Where up is now has to be said.
  EXPECT_EQ(UpOf(written.comments), (std::array<double, 3>{0, 0, 1}));
  options = {};
  ASSERT_TRUE(ParseAxes("RFU:", options).ok());
  ASSERT_TRUE(ConvertFile(folder / "rfu.ply", folder / "back.ply", options).ok());
  const GaussianCloud back = *ReadCloud(folder / "back.ply");
  EXPECT_EQ(CompareAttributes(back, cloud)->means.max, 0);
  EXPECT_LT(CompareAttributes(back, cloud)->harmonics.max, 2e-6);
  EXPECT_EQ(UpOf(back.comments), kUsualUp);
}

// What the user says counts more than what a file declares.
TEST(Convert, SaidAxesInsteadOfDeclaredOnes) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(50, 0, 3);
  GaussianCloud turned = cloud;
  TurnAxes(turned, Concatenate(TurnBetween(kRdf, *AxesFromName("RFU")), TurnBetween(kRub, kRdf)));
  ASSERT_TRUE(WriteCloud(folder / "a.spz", turned).ok());
  std::string bytes = FileBytes(folder / "a.spz");
  const uint32_t record[3] = {0xADBE0003, 4, 6};  // RDF, which it is not
  bytes[14] = 2;
  bytes[16] = 32 + sizeof record;
  bytes.insert(32, reinterpret_cast<const char*>(record), sizeof record);
  ASSERT_TRUE(WriteWholeFile(folder / "b.spz", bytes, false).ok());
  ConvertOptions options;
  ASSERT_TRUE(ParseAxes("RFU:", options).ok());
  ASSERT_TRUE(ConvertFile(folder / "b.spz", folder / "b.ply", options).ok());
  EXPECT_LT(CompareAttributes(*ReadCloud(folder / "b.ply"), cloud)->means.max, 1e-3);
  EXPECT_GT(CompareAttributes(*ReadCloud(folder / "b.spz"), cloud)->means.max, 1);
}

TEST(Convert, NumbersThatMeanSomethingElse) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(500, 1, 3);
  for (float& x : cloud.log_scales) x = 0.5f * x - 4;
  Random random(4);
  for (int64_t i = 0; i < 500; ++i) {
    for (int k = 0; k < 3; ++k) {
      cloud.sh[static_cast<size_t>(i * cloud.sh_stride() + k)] = DcFromColor(static_cast<float>(random.Uniform()));
    }
  }
  for (const float one : {1.0f, 255.0f}) {
    GaussianCloud other = cloud;
    for (float& x : other.log_scales) x = std::exp(x);
    for (float& x : other.opacity_logits) x = Sigmoid(x);
    for (int64_t i = 0; i < 500; ++i) {
      for (int k = 0; k < 3; ++k) {
        float& x = other.sh[static_cast<size_t>(i * cloud.sh_stride() + k)];
        x = one * ColorFromDc(x);
      }
    }
    std::filesystem::remove(folder / "in.ply");
    const auto input = Ply(folder, other);
    Messages messages;
    ConvertOptions options;
    options.write.overwrite = true;
    ASSERT_TRUE(ConvertFile(input, folder / "out.ply", options).ok());
    EXPECT_THAT(messages.TakeWarnings(),
                testing::ElementsAre(testing::HasSubstr("--scales lengths"), testing::HasSubstr("--opacities 0-1"),
                                     testing::HasSubstr(one == 1 ? "--colors 0-1" : "--colors 0-255")));
    options.stored = {.lengths = true, .opacities = true, .max_color = one};
    ASSERT_TRUE(ConvertFile(input, folder / "out.ply", options).ok());
    EXPECT_THAT(messages.TakeWarnings(), testing::IsEmpty());
    const auto error = CompareAttributes(*ReadCloud(folder / "out.ply"), cloud);
    EXPECT_LT(error->log_scales.max, 1e-5);
    EXPECT_LT(error->opacities.max, 1e-6);
    EXPECT_LT(error->colors.max, 1e-6);
  }
}

TEST(Convert, SaysWhatHasNoPlaceInTheFormat) {
  const TestFolder folder;
  Messages messages;
  GaussianCloud tame = RandomCloud(2000, 1, 3);
  for (float& x : tame.log_scales) x = -5;
  for (float& x : tame.sh) x *= 0.1f;
  int written = 0;
  const auto warn = [&](const GaussianCloud& cloud, const char* extension) {
    EXPECT_TRUE(WriteCloud(folder / (std::to_string(++written) + extension), cloud).ok());
    return messages.TakeWarnings();
  };
  using testing::AllOf, testing::ElementsAre, testing::HasSubstr, testing::IsEmpty;
  for (const char* lossy : {".compressed.ply", ".spz", ".sog", ".glb", ".ply", ".csv", ".npz"}) {
    EXPECT_THAT(warn(tame, lossy), IsEmpty()) << lossy;
  }
  EXPECT_THAT(warn(tame, ".splat"), ElementsAre(HasSubstr("harmonics above degree 0")));
  EXPECT_THAT(warn(WithShDegree(tame, 0), ".splat"), IsEmpty());

  GaussianCloud cloud = tame;
  cloud.log_scales[3] = -11;
  cloud.log_scales[5] = 30;
  cloud.log_scales[7] = std::nanf("");
  cloud.sh[12] = 3;
  cloud.sh[36 + 7] = 1.5f;
  const auto hidden = HasSubstr("1 of 2,000 Gaussians cannot be drawn");
  EXPECT_THAT(warn(cloud, ".spz"), ElementsAre(hidden, HasSubstr("1 of 2,000 Gaussians have log-scales beyond"),
                                               AllOf(HasSubstr("1 of 2,000"), HasSubstr("harmonics beyond"))));
  EXPECT_THAT(warn(WithShDegree(cloud, 0), ".splat"), ElementsAre(hidden, HasSubstr("f_dc beyond")));
  EXPECT_THAT(warn(cloud, ".sog"), ElementsAre(hidden, HasSubstr("log-scales beyond -20 to 20")));
  EXPECT_THAT(warn(cloud, ".ply"), IsEmpty());

  cloud = tame;
  cloud.log_scales[3] = -25;
  cloud.log_scales[7] = -INFINITY;
  for (const char* lossy : {".compressed.ply", ".sog"}) {
    EXPECT_THAT(warn(cloud, lossy), ElementsAre(HasSubstr("2 of 2,000 Gaussians have log-scales beyond -20"))) << lossy;
  }
  EXPECT_THAT(warn(cloud, ".ply"), IsEmpty());

  cloud = tame;
  cloud.means[0] = 30'000;  // one stray Gaussian
  const auto stray = AllOf(HasSubstr("1 of 2,000 Gaussians lie up to 30000 from"), HasSubstr("a PLY keeps them all"));
  EXPECT_THAT(warn(cloud, ".compressed.ply"), ElementsAre(stray));
  EXPECT_THAT(warn(cloud, ".spz"), ElementsAre(stray));
  EXPECT_THAT(warn(cloud, ".sog"), IsEmpty());
  EXPECT_THAT(warn(cloud, ".glb"), IsEmpty());
  for (size_t k = 0; k < 3; ++k) cloud.log_scales[k] = 10;  // a sky: more to see than all before it
  EXPECT_THAT(warn(cloud, ".compressed.ply"),
              ElementsAre(AllOf(HasSubstr("positions of 208 of 2,000 Gaussians"), HasSubstr("98 % lie within"))));
  EXPECT_THAT(warn(cloud, ".spz"), ElementsAre(HasSubstr("log-scales"),
                                               AllOf(HasSubstr("1/256 instead of 1/4096"), HasSubstr("reach 30000"))));
  for (size_t k = 0; k < 3; ++k) cloud.log_scales[k] = -5;
  cloud.means[0] = 1e30f;
  for (const char* lossy : {".compressed.ply", ".sog", ".spz"}) {
    EXPECT_THAT(warn(cloud, lossy), ElementsAre(HasSubstr("up to 1e+30 from"))) << lossy;
  }
  for (float& x : cloud.means) x *= 1e4f;  // large all over: coarse steps are right
  cloud.means[0] = 0;
  EXPECT_THAT(warn(cloud, ".spz"), IsEmpty());
}

TEST(Convert, FromAPipe) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(500, 1, 3);
  const auto input = Ply(folder, cloud), pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] { std::ofstream(pipe, std::ios::binary) << std::ifstream(input, std::ios::binary).rdbuf(); });
  const auto report = ConvertFile(pipe, folder / "out.ply", {});
  writer.join();
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->input_format, "PLY");
  EXPECT_EQ(report->input_bytes, std::filesystem::file_size(input));
  ExpectSameCloud(*ReadCloud(folder / "out.ply"), cloud);
}

TEST(Convert, FolderOfPicturesAppearsWholeOrNotAtAll) {
  const TestFolder folder;
  const auto input = Ply(folder, RandomCloud(50, 1, 3));
  ASSERT_TRUE(WriteWholeFile(folder / "sh0.webp", "in the way", false).ok());
  EXPECT_EQ(ConvertFile(input, folder / "meta.json", {}).error().code, ErrorCode::kExists);
  EXPECT_EQ(folder.Entries(), 2);
  ConvertOptions options;
  options.write.overwrite = true;
  const auto report = ConvertFile(input, folder / "meta.json", options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(folder.Entries(), 9);
  uint64_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) bytes += entry.file_size();
  EXPECT_EQ(report->output_bytes, bytes - std::filesystem::file_size(input));
}

TEST(Convert, TheInputStaysWhatItIs) {
  const TestFolder folder;
  const auto input = Ply(folder, RandomCloud(5, 0, 3));
  const std::string before = *InputFile::Open(input)->ReadAll(1 << 20);
  std::filesystem::create_symlink("in.ply", folder / "soft.ply");
  std::filesystem::create_hard_link(input, folder / "hard.ply");
  ConvertOptions options;
  options.write.overwrite = true;
  for (const char* output : {"in.ply", "soft.ply", "hard.ply", "./in.ply"}) {
    const auto report = ConvertFile(input, folder / output, options);
    ASSERT_FALSE(report.ok()) << output;
    EXPECT_EQ(report.error().code, ErrorCode::kBadArgument);
    EXPECT_THAT(report.error().message, testing::HasSubstr("write to another name"));
  }
  EXPECT_FALSE(ConvertFile(folder / "soft.ply", input, options).ok());
  EXPECT_EQ(*InputFile::Open(input)->ReadAll(1 << 20), before);
  // One of many, which is read later: no output may be any of the inputs.
  const InputRecord record;
  RecordSplat(folder / "gone.ply");
  RecordSplat(folder / "hard.ply");
  EXPECT_TRUE(CheckNotInput(folder / "a.ply").ok());
  EXPECT_FALSE(CheckNotInput(input).ok());
}

TEST(Convert, AFolderOfPicturesIsASplat) {
  const TestFolder folder;
  const auto input = Ply(folder, RandomCloud(50, 1, 3));
  std::filesystem::create_directory(folder / "scan");
  ASSERT_TRUE(ConvertFile(input, folder / "scan" / "meta.json", {}).ok());
  uint64_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "scan")) bytes += entry.file_size();
  const auto report = ConvertFile(folder / "scan", folder / "back.ply", {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->input_format, "SOG");
  EXPECT_EQ(report->input_bytes, bytes);
  EXPECT_EQ(ReadCloud(folder / "scan")->size(), 50);
  ConvertOptions options;
  options.write.overwrite = true;
  EXPECT_EQ(ConvertFile(folder / "scan", folder / "scan" / "meta.json", options).error().code, ErrorCode::kBadArgument);
  std::filesystem::create_directory(folder / "empty");
  const auto none = ReadCloud(folder / "empty");
  EXPECT_EQ(none.error().code, ErrorCode::kBadFile);
  EXPECT_THAT(none.error().message, testing::HasSubstr("without a meta.json"));
}

TEST(Convert, TheFormatOfTheInputCanBeSaid) {
  const TestFolder folder;
  const auto input = Ply(folder, RandomCloud(50, 0, 3));
  ASSERT_TRUE(ConvertFile(input, folder / "a.splat", {}).ok());
  std::filesystem::rename(folder / "a.splat", folder / "unknown");
  EXPECT_EQ(ConvertFile(folder / "unknown", folder / "b.ply", {}).error().code, ErrorCode::kBadFile);
  ConvertOptions options;
  options.input_format = FormatOfName("splat");
  const auto report = ConvertFile(folder / "unknown", folder / "b.ply", options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->input_format, "splat");
  EXPECT_EQ(report->gaussians_written, 50);
  EXPECT_EQ(FormatOfName(".compressed.ply")->name, "compressed PLY");
  EXPECT_EQ(FormatOfName(".SPZ")->name, "SPZ");
  EXPECT_EQ(FormatOfName(""), nullptr);
  EXPECT_EQ(FormatOfName("obj"), nullptr);
}

TEST(Convert, SaysWhatIsNoNumber) {
  const TestFolder folder;
  Messages messages;
  GaussianCloud cloud = RandomCloud(300, 0, 3);
  cloud.log_scales[7] = -INFINITY;  // a length of zero
  const auto warn = [&] {
    EXPECT_TRUE(ConvertFile(Ply(folder, cloud), folder / "out.csv", {.write = {.overwrite = true}}).ok());
    return messages.TakeWarnings();
  };
  EXPECT_THAT(warn(), testing::IsEmpty());
  cloud.opacity_logits[9] = INFINITY;  // an opacity of one
  EXPECT_THAT(warn(), testing::IsEmpty());
  cloud.log_scales[29] = INFINITY;
  cloud.means[30] = cloud.quats[41] = NAN;  // of one Gaussian
  EXPECT_THAT(warn(), testing::ElementsAre(testing::HasSubstr("2 of 300 Gaussians")));
  // A compressed PLY whose ranges are no numbers.
  ASSERT_TRUE(WriteCloud(folder / "a.compressed.ply", RandomCloud(300, 0, 3)).ok());
  std::string bytes = *InputFile::Open(folder / "a.compressed.ply")->ReadAll(1 << 20);
  const size_t begin = bytes.find("end_header\n") + 11;
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(begin), 2 * 18 * 4, '\xff');
  ASSERT_TRUE(WriteWholeFile(folder / "a.compressed.ply", bytes, true).ok());
  messages.TakeWarnings();
  ASSERT_TRUE(ConvertFile(folder / "a.compressed.ply", folder / "b.ply", {}).ok());
  EXPECT_THAT(messages.TakeWarnings(), testing::ElementsAre(testing::HasSubstr("300 of 300 Gaussians")));
}

TEST(Convert, ErrorsOfBothSides) {
  const TestFolder folder;
  const auto input = Ply(folder, RandomCloud(5, 0, 3));
  EXPECT_EQ(ConvertFile(folder / "gone.ply", folder / "a.spz", {}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ConvertFile(input, folder / "a.obj", {}).error().code, ErrorCode::kBadArgument);
  ASSERT_TRUE(WriteWholeFile(folder / "b.ply", "there", false).ok());
  EXPECT_EQ(ConvertFile(input, folder / "b.ply", {}).error().code, ErrorCode::kExists);
  std::filesystem::remove(folder / "b.ply");
  EXPECT_EQ(folder.Entries(), 1);
}

}  // namespace
}  // namespace anchorsplat

#include "formats/convert.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "formats/ply_writer.h"
#include "formats/registry.h"
#include "formats/splat_order.h"
#include "formats/test_cloud.h"
#include "formats/test_folder.h"

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
    const auto output =
        folder /
        (std::string(format.extensions[0]) == "meta.json" ? "meta.json" : "out" + std::string(format.extensions[0]));
    const auto report = ConvertFile(input, output, {.measure = true});
    ASSERT_TRUE(report.ok()) << report.error().message;
    ++written;
    EXPECT_EQ(report->output_format, format.name);
    EXPECT_EQ(report->gaussians_written, 2000);
    EXPECT_EQ(report->output_bytes, std::filesystem::file_size(output));
    EXPECT_EQ(report->predicted_bytes.value_or(report->output_bytes), report->output_bytes) << format.name;
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
  for (const char* bad : {"", ":", "XYZ", "RDF:abc", "RDF:RUB:LUF"}) EXPECT_FALSE(ParseAxes(bad, options).ok()) << bad;
}

TEST(Convert, ErrorsOfBothSides) {
  const TestFolder folder;
  const auto input = Ply(folder, RandomCloud(5, 0, 3));
  EXPECT_EQ(ConvertFile(folder / "gone.ply", folder / "a.spz", {}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ConvertFile(input, folder / "a.obj", {}).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(ConvertFile(input, input, {}).error().code, ErrorCode::kExists);
  EXPECT_EQ(folder.Entries(), 1);
}

}  // namespace
}  // namespace anchorsplat

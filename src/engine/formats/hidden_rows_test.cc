#include "formats/hidden_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/camera.h"
#include "core/messages_for_test.h"
#include "core/random.h"
#include "core/statistics.h"
#include "core/text.h"
#include "formats/attribute_error.h"
#include "formats/cloud_io.h"
#include "formats/convert.h"
#include "formats/registry.h"
#include "formats/splat_order.h"
#include "io/folder_for_test.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"

namespace anchorsplat {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
const float kNan = std::nanf("");
const std::vector<std::string> kNames = {"a.compressed.ply", "a.splat",      "a.spz", "a.sog", "a.glb",
                                         "a.gltf",           "lod-meta.json"};

// A small thing, two units across.
GaussianCloud Thing(int64_t n, int degree) {
  GaussianCloud cloud;
  cloud.Resize(n, degree);
  Random random(5);
  for (float& x : cloud.means) x = static_cast<float>(random.Uniform(-1, 1));
  for (float& x : cloud.log_scales) x = static_cast<float>(random.Uniform(-3.5, -2.5));
  for (float& x : cloud.quats) x = static_cast<float>(random.Normal());
  for (float& x : cloud.opacity_logits) x = static_cast<float>(random.Uniform(0, 4));
  for (float& x : cloud.sh) x = static_cast<float>(random.Uniform(-0.1, 0.1));
  for (int64_t i = 0; i < n; ++i) {
    for (int64_t c = 0; c < 3; ++c) cloud.sh[static_cast<size_t>(i * cloud.sh_stride() + c)] *= 14;
  }
  return cloud;
}

std::vector<float> Picture(const GaussianCloud& cloud) {
  Camera camera;
  camera.intrinsics = PinholeFromFov(96, 96, 0.8);
  camera.world_to_camera.translation = {0.1, -0.2, 4};
  RenderOptions options = DisplayOptions(cloud);
  options.subject.reset();
  options.sh_degree = 0;  // .splat has no more
  Rasterizer rasterizer;
  RenderOutput output;
  EXPECT_TRUE(rasterizer.Render(cloud, camera, options, output).ok());
  std::vector<float> pixels(output.color.pixels.begin(), output.color.pixels.end());
  for (float& x : pixels) x = std::clamp(x, 0.0f, 1.0f);
  return pixels;
}

double PsnrOf(const std::vector<float>& a, const std::vector<float>& b) {
  double squares = 0;
  for (size_t k = 0; k < a.size(); ++k) squares += (a[k] - b[k]) * (a[k] - b[k]);
  return -10 * std::log10(squares / static_cast<double>(a.size()) + 1e-12);
}

GaussianCloud WrittenAndRead(const TestFolder& folder, const std::string& name, const GaussianCloud& cloud) {
  const std::filesystem::path path = folder / name;
  const Status written = WriteCloud(path, cloud, {.overwrite = true});
  EXPECT_TRUE(written.ok()) << name << ": " << written.error().message;
  auto read = ReadCloud(path);
  EXPECT_TRUE(read.ok()) << name << ": " << read.error().message;
  return read.ok() ? *std::move(read) : GaussianCloud();
}

using Spoil = std::function<void(GaussianCloud&, size_t row)>;
Spoil Scales(float x, float y, float z) {
  return [=](GaussianCloud& cloud, size_t row) {
    cloud.log_scales[3 * row] = x, cloud.log_scales[3 * row + 1] = y, cloud.log_scales[3 * row + 2] = z;
  };
}
Spoil Array(Buffer<float> GaussianCloud::*array, float value, size_t column = 0) {
  return [=](GaussianCloud& cloud, size_t row) {
    Buffer<float>& values = cloud.*array;
    values[row * (values.size() / cloud.opacity_logits.size()) + column] = value;
  };
}

// What cannot be drawn does not begin to show, and what can does not stop.
TEST(HiddenRows, PicturesOfAllFormatsShowWhatTheInputShows) {
  const TestFolder folder;
  const std::vector<std::pair<std::string, Spoil>> spoils = {
      {"size inf", Scales(kInf, kInf, kInf)},
      {"one size inf", Scales(-3, kInf, -3)},
      {"size 45", Scales(45, 45, 45)},
      {"size 60", Scales(60, 60, 60)},
      {"size 88", Scales(88, 88, 88)},
      {"size 90", Scales(90, 90, 90)},
      {"needle 95", Scales(-3, -3, 95)},
      {"size 3e38", Scales(3e38f, 0, 0)},
      {"size NaN", Scales(kNan, -3, -3)},
      {"flat", Scales(-kInf, -2, -2)},
      {"point", Scales(-kInf, -kInf, -kInf)},
      {"mean NaN", Array(&GaussianCloud::means, kNan)},
      {"mean inf", Array(&GaussianCloud::means, kInf, 1)},
      {"mean -inf", Array(&GaussianCloud::means, -kInf, 2)},
      {"logit NaN", Array(&GaussianCloud::opacity_logits, kNan)},
      {"logit inf", Array(&GaussianCloud::opacity_logits, kInf)},
      {"logit -inf", Array(&GaussianCloud::opacity_logits, -kInf)},
      {"quaternion NaN", Array(&GaussianCloud::quats, kNan, 2)},
      {"quaternion inf", Array(&GaussianCloud::quats, kInf, 3)},
      {"colour NaN", Array(&GaussianCloud::sh, kNan, 1)},
      {"colour inf", Array(&GaussianCloud::sh, kInf)},
      {"harmonics NaN", Array(&GaussianCloud::sh, kNan, 11)},
      {"zero quaternion", [](GaussianCloud& c, size_t i) { std::fill_n(c.quats.data() + 4 * i, 4, 0.0f); }},
      {"long quaternion",
       [](GaussianCloud& c, size_t i) {
         for (size_t k = 0; k < 4; ++k) c.quats[4 * i + k] *= 1e30f;
         Scales(-1, -5, -5)(c, i);
       }},
      {"short quaternion",
       [](GaussianCloud& c, size_t i) {
         for (size_t k = 0; k < 4; ++k) c.quats[4 * i + k] *= 1e-30f;
         Scales(-1, -5, -5)(c, i);
       }},
      {"faint veil",
       [](GaussianCloud& c, size_t i) {
         Scales(5, 5, 5)(c, i);
         c.opacity_logits[i] = -5.7f;
       }},
  };
  for (const auto& [what, spoil] : spoils) {
    GaussianCloud cloud = Thing(400, 1);
    for (const size_t row : {0u, 1u, 7u, 8u, 150u, 399u}) spoil(cloud, row);
    const std::vector<float> before = Picture(cloud);
    for (const std::string& name : kNames) {
      SCOPED_TRACE(what + ", " + name);
      const Messages messages;
      const GaussianCloud back = WrittenAndRead(folder, name, cloud);
      EXPECT_GT(PsnrOf(before, Picture(back)), 35);
      const int64_t unusable = CountUnusable(cloud);
      int warned = 0;
      for (const std::string& text : messages.warnings())
        warned += text.find("6 of 400 Gaussians") != text.npos ? 1 : 0;
      if (unusable > 0) {
        EXPECT_EQ(warned, 1);
        EXPECT_EQ(back.size(), name == "lod-meta.json" ? 394 : 400);
      }
    }
    for (const std::string name : {"a.ply"}) {
      const GaussianCloud back = WrittenAndRead(folder, name, cloud);
      EXPECT_EQ(CountUnusable(back), CountUnusable(cloud)) << what;
    }
  }
}

TEST(HiddenRows, NothingIsLeftToShowWhereAllAreSpoilt) {
  const TestFolder folder;
  GaussianCloud cloud = Thing(10, 0);
  for (float& x : cloud.log_scales) x = kInf;
  for (const std::string name : {"a.compressed.ply", "a.splat", "a.spz", "a.sog", "a.glb"}) {
    const GaussianCloud back = WrittenAndRead(folder, name, cloud);
    EXPECT_EQ(back.size(), 10);
    EXPECT_LT(*std::ranges::max_element(back.opacity_logits), -10) << name;
  }
}

TEST(HiddenRows, ConvertChoosesWhatIsDrawn) {
  GaussianCloud cloud = Thing(40, 0);
  for (size_t k = 0; k < 9; ++k) cloud.log_scales[k] = kInf;
  for (size_t k = 18; k < 27; ++k) cloud.log_scales[k] = 95;
  for (size_t k = 30; k < 33; ++k) cloud.log_scales[k] = 20;
  cloud.opacity_logits[10] = -6;
  GaussianCloud kept = cloud;
  KeepMostImportant(kept, 20);
  EXPECT_EQ(kept.size(), 20);
  for (int64_t i = 0; i < kept.size(); ++i) EXPECT_TRUE(IsDrawn(kept, i)) << i;
  DropFaint(cloud, 0.01f);
  EXPECT_EQ(cloud.size(), 33);
}

// ---- strays

double RmsOfMeans(const GaussianCloud& a, const GaussianCloud& b, const Buffer<uint32_t>& rows, int64_t but) {
  double squares = 0;
  for (size_t i = 0; i < a.opacity_logits.size(); ++i) {
    const size_t j = rows.empty() ? i : rows[i];
    if (static_cast<int64_t>(j) >= but) continue;
    for (size_t k = 0; k < 3; ++k) squares += std::pow(double{a.means[3 * i + k]} - double{b.means[3 * j + k]}, 2);
  }
  return std::sqrt(squares / static_cast<double>(but));
}

TEST(Strays, CostTheOthersNothing) {
  const TestFolder folder;
  for (const int64_t strays : {1, 3, 12}) {
    for (const float away : {1e3f, 1e6f, 1e30f, -1e30f}) {
      GaussianCloud cloud = Thing(400 + strays, 0);
      for (int64_t i = 400; i < 400 + strays; ++i) cloud.means[static_cast<size_t>(3 * i + i % 3)] = away;
      for (const std::string name : {"a.compressed.ply", "a.spz", "a.sog", "a.splat", "a.glb"}) {
        SCOPED_TRACE(Cat(name, " ", strays, " ", away));
        const Messages messages;
        const GaussianCloud back = WrittenAndRead(folder, name, cloud);
        const SplatFormat& format = *FormatOfExtension(name);
        const HiddenRows hidden = HideRows(format, cloud);
        const Buffer<uint32_t> rows =
            WriteOrder(hidden.any() ? CloudView(hidden.written) : CloudView(cloud), SplatOrder::kFormat, format.order);
        EXPECT_LT(RmsOfMeans(back, cloud, rows, 400), 2e-3);
        EXPECT_GT(PsnrOf(Picture(cloud), Picture(back)), 38);
        EXPECT_LE(messages.warnings().size(), 1);
        if (hidden.any()) {
          EXPECT_EQ(messages.warnings().size(), 1);
          EXPECT_EQ(std::ssize(hidden.strays.rows), strays);
          EXPECT_NEAR(hidden.strays.farthest / std::fabs(away), 1, 0.01);
        }
      }
    }
  }
}

// Of a view from the middle a sky covers more than what is before it: it stays.
TEST(Strays, SkiesStayWhereTheyAre) {
  const TestFolder folder;
  GaussianCloud cloud = Thing(2000, 0);
  Random random(8);
  for (size_t i = 1900; i < 2000; ++i) {
    std::array<double, 3> d{};
    for (double& x : d) x = random.Normal();
    const double factor = 300 / std::hypot(d[0], d[1], d[2]);
    for (size_t k = 0; k < 3; ++k) {
      cloud.means[3 * i + k] = static_cast<float>(factor * d[k]);
      cloud.log_scales[3 * i + k] = 4;
    }
  }
  const std::vector<float> before = Picture(cloud);
  for (const std::string name : {"a.compressed.ply", "a.spz", "a.sog"}) {
    EXPECT_TRUE(HideRows(*FormatOfExtension(name), cloud).strays.rows.empty()) << name;
    EXPECT_GT(PsnrOf(before, Picture(WrittenAndRead(folder, name, cloud))), 35) << name;
  }
}

TEST(Strays, ReportComparesTheRightRows) {
  const TestFolder folder;
  GaussianCloud cloud = Thing(700, 0);
  cloud.means[3 * 100] = 1e6f;
  cloud.log_scales[3 * 300] = kInf;
  ASSERT_TRUE(WriteCloud(folder / "in.ply", cloud).ok());
  for (const std::string name : {"a.compressed.ply", "a.sog", "a.spz", "a.splat"}) {
    const auto report = ConvertFile(folder / "in.ply", folder / name, {.measure = true});
    ASSERT_TRUE(report.ok());
    const auto hidden = HideRows(*FormatOfExtension(name), cloud);
    EXPECT_EQ(report->error->left_out, 1 + std::ssize(hidden.strays.rows)) << name;
    EXPECT_LT(report->error->means.rms, 0.01) << name;
    EXPECT_LT(report->error->log_scales.rms, 0.4) << name;
    EXPECT_LT(report->error->colors.rms, 0.1) << name;
  }
}

}  // namespace
}  // namespace anchorsplat

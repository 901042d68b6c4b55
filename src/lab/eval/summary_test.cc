#include "eval/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "eval/filter_sweep.h"
#include "eval/report.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

MethodResult Scores(const std::string& object, const std::string& method, const std::vector<double>& psnr) {
  MethodResult result;
  result.object = object;
  result.method = method;
  for (size_t i = 0; i < psnr.size(); ++i) {
    result.views.push_back({Cat("v", i), psnr[i], 0.9, std::nullopt});
  }
  result.seconds = 2;
  return result;
}

// Three objects of one, two and three views; "model" fails on the last.
Evaluation Small(Protocol protocol) {
  Evaluation e;
  e.protocol = protocol;
  e.methods = {"raw", "filter", "model"};
  e.objects = {"a", "b", "c"};
  e.results = {Scores("a", "raw", {30}),         Scores("a", "filter", {34}),        Scores("a", "model", {35}),
               Scores("b", "raw", {26, 28}),     Scores("b", "filter", {30, 32}),    Scores("b", "model", {29, 31}),
               Scores("c", "raw", {20, 21, 22}), Scores("c", "filter", {24, 25, 26})};
  e.failures = {{"c", "model", "the | network\nfailed"}};
  return e;
}

TEST(Summary, HeldOutWeighsObjectsAlikeAndUpstreamPictures) {
  const auto heldout = Summarise(Small(Protocol::kHeldOut), 1);
  ASSERT_EQ(heldout.size(), 3u);
  EXPECT_NEAR(heldout[0].psnr.mean, (30.0 + 27 + 21) / 3, 1e-12);
  const auto upstream = Summarise(Small(Protocol::kUpstream), 1);
  EXPECT_NEAR(upstream[0].psnr.mean, (30.0 + 26 + 28 + 20 + 21 + 22) / 6, 1e-12);
}

TEST(Summary, GainsAndWinsAreOverCommonObjects) {
  const auto rows = Summarise(Small(Protocol::kHeldOut), 1);
  EXPECT_FALSE(rows[0].gain_over_raw);
  EXPECT_NEAR(rows[1].gain_over_raw->mean, 4, 1e-12);
  EXPECT_NEAR(rows[1].gain_over_raw->low, 4, 1e-12);  // the same on every object
  EXPECT_NEAR(rows[1].gain_over_raw->high, 4, 1e-12);
  EXPECT_FALSE(rows[1].gain_over_filter);
  EXPECT_EQ(rows[2].objects, 2);
  EXPECT_NEAR(rows[2].gain_over_raw->mean, (5 + 3) / 2.0, 1e-12);
  EXPECT_NEAR(rows[2].gain_over_filter->mean, 0, 1e-12);
  EXPECT_EQ(rows[2].compared_with_filter, 2);
  EXPECT_EQ(rows[2].wins_over_filter, 1);
  EXPECT_EQ(rows[2].seconds, 2);
}

TEST(Summary, BootstrapFindsTheStandardErrorAndIsTheSameEveryTime) {
  std::vector<double> values, weights;
  for (int i = 0; i < 40; ++i) {
    values.push_back(std::sin(12.9 * i) * 3 + 30);
    weights.push_back(1);
  }
  double mean = 0, variance = 0;
  for (const double v : values) mean += v / 40;
  for (const double v : values) variance += (v - mean) * (v - mean) / 40;
  const double error = std::sqrt(variance / 40);
  const Interval interval = BootstrapMean(values, weights, 7);
  EXPECT_NEAR(interval.mean, mean, 1e-12);
  EXPECT_NEAR(interval.low, mean - 1.96 * error, 0.1 * error);
  EXPECT_NEAR(interval.high, mean + 1.96 * error, 0.1 * error);
  EXPECT_EQ(BootstrapMean(values, weights, 7).low, interval.low);
  EXPECT_NE(BootstrapMean(values, weights, 8).low, interval.low);

  const Interval one = BootstrapMean({31.5}, {1}, 7);
  EXPECT_EQ(one.low, 31.5);
  EXPECT_EQ(one.high, 31.5);
  EXPECT_TRUE(std::isinf(BootstrapMean({1, std::numeric_limits<double>::infinity()}, {1, 1}, 7).mean));
}

TEST(Summary, PixelSizeErrors) {
  Evaluation e = Small(Protocol::kHeldOut);
  EXPECT_FALSE(SummarisePixelSizes(e));
  e.results[0].facts["pixel_size_ratio"] = 0.9;
  e.results[3].facts["pixel_size_ratio"] = 1.3;
  e.results[6].facts["pixel_size_ratio"] = 1.02;
  const auto error = SummarisePixelSizes(e);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->objects, 3);
  EXPECT_NEAR(error->median, 0.1, 1e-12);
  EXPECT_NEAR(error->percentile95, 0.1 + 0.9 * 0.2, 1e-12);
}

TEST(FilterSweep, TopOfParabola) {
  const std::vector<double> x = {0, 0.25, 0.4, 0.5};
  const auto y = [&](double top) {
    std::vector<double> values;
    values.reserve(x.size());
    for (const double at : x) values.push_back(30 - (at - top) * (at - top));
    return values;
  };
  EXPECT_NEAR(TopOfParabola(x, y(0.3)), 0.3, 1e-12);  // a parabola is found exactly, even on uneven steps
  EXPECT_NEAR(TopOfParabola(x, y(0.42)), 0.42, 1e-12);
  EXPECT_EQ(TopOfParabola(x, y(2)), 0.5);
  EXPECT_EQ(TopOfParabola(x, y(-1)), 0);
  EXPECT_EQ(TopOfParabola(x, std::vector<double>{1, 1, 1, 1}), 0);
}

TEST(Report, TablesSayEverything) {
  Evaluation e = Small(Protocol::kHeldOut);
  e.results[1].facts["pixel_size_ratio"] = 0.93;
  const auto rows = Summarise(e, 1);
  const std::string markdown = ToMarkdown(e, rows, "a title");
  EXPECT_THAT(markdown, HasSubstr("| model | 2 | 32.50 (30.00–35.00) |"));
  EXPECT_THAT(markdown, HasSubstr("| 1 of 2 |"));
  EXPECT_THAT(markdown, HasSubstr("| c | 21.00 / 0.9000 | 25.00 / 0.9000 | failed |"));
  EXPECT_THAT(markdown, HasSubstr("| 0.93 |"));
  EXPECT_THAT(markdown, HasSubstr("* c, model: the   network failed"));
  EXPECT_THAT(markdown, Not(HasSubstr("LPIPS")));
  const std::string csv = ToCsv(e);
  EXPECT_THAT(
      csv, HasSubstr("object,method,views,psnr,ssim,lpips,seconds,render_seconds,gaussians,kind,pixel_size_ratio\n"));
  EXPECT_THAT(csv, HasSubstr("\nb,raw,2,27.0000,0.900000,,2.000,0.000,0,,\n"));
  e.results[0].views[0].psnr = std::numeric_limits<double>::infinity();
  e.results[0].object = "a, \"b\"";
  EXPECT_THAT(ToCsv(e), HasSubstr("\n\"a, \"\"b\"\"\",raw,1,inf,"));
  const nlohmann::json json = ToJson(e, Summarise(e, 1));
  EXPECT_TRUE(json["methods"][0]["psnr"]["mean"].is_null());
  EXPECT_EQ(json["failures"].size(), 1u);
  EXPECT_EQ(json["results"].size(), 8u);
}

TEST(Summary, KindsHaveTheirOwnRowsAndTheirWorstObject) {
  Evaluation e = Small(Protocol::kHeldOut);
  EXPECT_TRUE(SummariseKinds(e, 1).empty());  // nothing says
  e.kinds = {"x", "x", "x"};
  EXPECT_TRUE(SummariseKinds(e, 1).empty());  // all alike
  e.kinds = {"x", "y", "x"};
  e.results[5].views = {{"v0", 25, 0.9, std::nullopt}, {"v1", 26, 0.9, std::nullopt}};  // model on b
  const auto rows = SummariseKinds(e, 1);
  ASSERT_EQ(rows.size(), 6u);
  EXPECT_EQ(rows[0].kind, "x");
  EXPECT_EQ(rows[0].summary.method, "raw");
  EXPECT_FALSE(rows[0].worst);
  EXPECT_EQ(rows[1].summary.objects, 2);
  EXPECT_NEAR(rows[1].summary.psnr.mean, (34 + 25) / 2.0, 1e-12);
  EXPECT_EQ(rows[5].kind, "y");
  EXPECT_EQ(rows[5].worst->object, "b");
  EXPECT_NEAR(rows[5].worst->gain, 25.5 - 27, 1e-12);
  EXPECT_EQ(rows[5].worst->over, "raw");
  EXPECT_EQ(WorstOverRaw(e)->method, "model");
  EXPECT_EQ(WorstSentence(e), "Worst loss over raw: 1.50 dB, model on b.");
  const std::string markdown = ToMarkdown(e, Summarise(e, 1), "kinds");
  EXPECT_THAT(markdown, HasSubstr("| y | model | 1 | 25.50 |"));
  EXPECT_THAT(markdown, HasSubstr("b -1.50 |"));
  EXPECT_THAT(markdown, HasSubstr("Worst loss over raw: 1.50 dB"));
  EXPECT_THAT(ToCsv(e), HasSubstr(",0,y\n"));
  const nlohmann::json json = ToJson(e, Summarise(e, 1));
  EXPECT_EQ(json["kinds"].size(), 6u);
  EXPECT_EQ(json["kinds"][5]["worst"]["object"], "b");
  EXPECT_EQ(json["results"][5]["kind"], "y");
  EXPECT_EQ(json["worst_over_raw"]["kind"], "y");

  // Without raw the filter is what the worst is measured against.
  std::erase_if(e.results, [](const MethodResult& result) { return result.method == "raw"; });
  const auto without = SummariseKinds(e, 1);
  EXPECT_EQ(without.back().worst->over, "filter");
  EXPECT_FALSE(WorstOverRaw(e));
  EXPECT_EQ(WorstSentence(e), "");
}

}  // namespace
}  // namespace anchorsplat

#include "eval/reading_score.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "core/source_dir_for_test.h"
#include "core/text.h"
#include "io/atomic_file.h"
#include "io/folder_for_test.h"
#include "reading/features.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

std::string Head() {
  return Cat(R"({"table":"readings","multiples":[0.25,0.35,0.5,0.7,1,1.4,2],"features":)",
             nlohmann::json(FeatureNames()).dump(), "}\n");
}

std::filesystem::path Write(const TestFolder& folder, const std::string& text) {
  const std::filesystem::path path = folder / "table.jsonl";
  EXPECT_TRUE(WriteWholeFile(path, text, true).ok());
  return path;
}

Result<std::vector<ReadingRow>> Read(const std::string& rows) {
  const TestFolder folder;
  return ReadReadingTable(Write(folder, Head() + rows));
}

constexpr const char* kClassicRow =
    R"({"id":"a","kind":"standard","edit":"","made":"classic","tag":null,"pixel":0.01,
"gains":{"classic":{"filter":[1,2,3,4,5,4,-1],"network":[1,2,3,4,6,2,-3]},"antialiased":{"filter":[0,0,0,0,0,0,1]}},
"list":{"method":"model","strength":0.74,"pixel":0.014,"low":0.012,"high":0.02,"looks":"classic","mode":null,"gain":1.9,"seconds":0.5,"one_size":true}})";
// A line is a row.
std::string OneLine(std::string text) {
  std::erase(text, '\n');
  return text + "\n";
}

TEST(ReadingTable, GainsAreLinearInTheLogarithm) {
  const auto rows = Read(OneLine(kClassicRow));
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  const ReadingRow& row = rows->at(0);
  for (size_t k = 0; k < kGainMultiples.size(); ++k) {
    EXPECT_DOUBLE_EQ(row.GainOf("filter", RenderMode::kClassic, kGainMultiples[k]),
                     (std::array{1, 2, 3, 4, 5, 4, -1}[k]));
  }
  EXPECT_NEAR(row.GainOf("filter", RenderMode::kClassic, std::sqrt(2.8)), 1.5, 1e-12);
  EXPECT_NEAR(row.GainOf("filter", RenderMode::kClassic, 0.125), 0.25, 1e-12);      // the square of a half
  EXPECT_NEAR(row.GainOf("filter", RenderMode::kClassic, 2 * 2 / 1.4), -6, 1e-12);  // goes on falling
  EXPECT_EQ(row.GainOf("filter", RenderMode::kAntialiased, 1e12), 1);               // and never rising
  EXPECT_GT(row.GainOf("filter", RenderMode::kClassic, 1e30), -100);                // nor without end
  EXPECT_EQ(row.GainOf("none", RenderMode::kClassic, 1), 0);
  EXPECT_EQ(row.GainOf("filter", RenderMode::kClassic, 0), 0);
  EXPECT_EQ(row.DrawnMode(), RenderMode::kClassic);
  EXPECT_TRUE(std::isnan(row.GainOf("network", RenderMode::kAntialiased, 1)));
}

TEST(ReadingTable, ErrorsNameTheLine) {
  EXPECT_THAT(Read("{\"id\":1}\n").error().message, HasSubstr("line 2"));
  EXPECT_THAT(Read("nonsense").error().message, HasSubstr("line 2"));
  EXPECT_THAT(Read("").error().message, HasSubstr("no rows"));
  EXPECT_THAT(Read(R"({"id":"a","list":{"method":"none"},"gains":{"classic":{"filter":[1,2]}}})").error().message,
              HasSubstr("line 2"));
  const TestFolder folder;
  EXPECT_THAT(ReadReadingTable(Write(folder, "{\"table\":\"others\"}\n{}\n")).error().message, HasSubstr("line 1"));
  EXPECT_THAT(ReadReadingTable(Write(folder, "[]\n")).error().message, HasSubstr("line 1"));
  EXPECT_THAT(Read(R"({"id":"a","list":{"method":"none"},"gains":"x"})").error().message, HasSubstr("line 2"));
  EXPECT_THAT(Read(R"({"id":"a","unit":1,"features":[1]})").error().message,
              HasSubstr("line 2: has another number of features"));
  EXPECT_EQ(ReadReadingTable(folder / "none").error().code, ErrorCode::kNotFound);
}

TEST(ReadingTable, DecisionsAreReadAndRefused) {
  const TestFolder folder;
  const std::vector<ReadingRow> rows = *Read(OneLine(kClassicRow));
  const auto decisions = ReadReadingDecisions(
      Write(
          folder,
          "\n"
          R"({"id":"a","method":"filter","mode":"antialiased","pixel":0.02,"low":0.01,"high":0.03,"made":"widened"})"),
      rows);
  ASSERT_TRUE(decisions.ok()) << decisions.error().message;
  EXPECT_EQ(decisions->at("a").mode, RenderMode::kAntialiased);
  EXPECT_EQ(decisions->at("a").pixel, 0.02);
  EXPECT_FALSE(decisions->at("a").gain);
  const auto refused = [&](const std::string& text) {
    const auto wrong = ReadReadingDecisions(Write(folder, text), rows);
    return wrong.ok() ? "" : wrong.error().message;
  };
  EXPECT_EQ(refused(R"({"id":"a","method":"none"})"), "");
  EXPECT_THAT(refused(R"({"id":"a","method":"model"})"), HasSubstr("line 1: method 'model'"));
  EXPECT_THAT(refused(R"({"id":"a","method":"none","mode":"m"})"), HasSubstr("mode 'm'"));
  EXPECT_THAT(refused(R"({"id":"z","method":"none"})"), HasSubstr("unknown row z"));
  EXPECT_THAT(refused(R"({"id":"a","method":"filter"})"), HasSubstr("needs a pixel"));
  EXPECT_THAT(refused(R"({"id":"a","method":"filter","pixel":-1})"), HasSubstr("needs a pixel"));
  EXPECT_THAT(refused(R"({"id":"a","method":"network","mode":"antialiased","pixel":1})"),
              HasSubstr("was not measured"));
  EXPECT_THAT(refused(R"({"id":"a","method":"none","low":2,"high":1})"), HasSubstr("low and high must be"));
  EXPECT_THAT(refused(R"({"id":"a","method":"none","low":0,"high":1})"), HasSubstr("low and high must be"));
  EXPECT_THAT(refused(R"({"id":"a","method":"none","seconds":1e39})"), HasSubstr("seconds"));
  EXPECT_THAT(refused(R"({"id":"a","method":"none","made":"banana"})"), HasSubstr("banana"));
  EXPECT_THAT(refused(R"({"id":"a","method":"none","pixl":1})"), HasSubstr("unknown property pixl"));
  EXPECT_THAT(refused(R"({"id":"a"})"), HasSubstr("line 1: a property is missing"));
  const std::string twice = R"({"id":"a","method":"none"})";
  EXPECT_THAT(refused(twice + "\n" + twice), HasSubstr("line 2: a has two decisions"));
}

ReadingRow Row(const std::string& id, const std::string& kind, const std::string& edit, const std::string& made,
               ReadingGains filter, double gain_today) {
  ReadingRow row;
  row.id = id;
  row.kind = kind;
  row.edit = edit;
  row.made = made;
  row.pixel = 1;
  row.gains[{RenderMode::kClassic, "filter"}] = filter;
  row.gains[{RenderMode::kClassic, "network"}] = {0, 0, 0, 0, 0, 0, 0};
  row.today.method = "filter";
  row.today.gain = gain_today;
  row.today.made = "classic";
  row.today.seconds = 2;
  return row;
}

std::vector<ReadingRow> SomeRows() {
  std::vector<ReadingRow> rows = {Row("a", "standard", "", "classic", {1, 1, 2, 3, 4, 2, 0}, 3.5),
                                  Row("b", "standard", "", "classic", {0, 0, 0, 0, 1, 3, 5}, -0.5),
                                  Row("c", "standard", "cropped", "mip", {-1, -1, -1, -2, -2, -2, -2}, 0.25)};
  rows[0].today.low = 0.5, rows[0].today.high = 1.5;
  rows[1].today.low = 1.5, rows[1].today.high = 2.5;
  rows[1].today.made = "widened";
  rows[2].today.made = "widened";
  ReadingRow stranger;  // without truth
  stranger.id = "d";
  stranger.kind = "stranger";
  stranger.today.seconds = 8;
  rows.push_back(stranger);
  return rows;
}

TEST(ReadingScore, CountsByHand) {
  const std::vector<ReadingRow> rows = SomeRows();
  const std::vector<ReadingScore> scores = ScoreReadings(rows, TodaysDecisions(rows));
  ASSERT_EQ(scores.size(), 4u);  // all, two kinds, an edit
  const ReadingScore& all = scores[0];
  EXPECT_EQ(all.group, kReadingAll);
  EXPECT_EQ(all.rows, 3);
  EXPECT_NEAR(all.mean, 3.25 / 3, 1e-12);
  EXPECT_EQ(all.worst, -0.5);
  EXPECT_EQ(all.worst_id, "b");
  EXPECT_NEAR(all.losing, 1 / 3.0, 1e-12);
  EXPECT_EQ(all.intervals, 3);  // of one nothing is said
  EXPECT_EQ(all.held, 1);
  EXPECT_NEAR(all.width, std::sqrt(3 * 2.5 / 1.5), 1e-12);
  EXPECT_EQ(all.named, 3);
  EXPECT_EQ(all.recognised, 2);  // a mip splat is rightly called widened
  EXPECT_EQ(all.could_be_accused, 2);
  EXPECT_EQ(all.accused, 1);
  EXPECT_EQ(all.seconds, 2);
  EXPECT_EQ(scores[1].group, "standard");
  EXPECT_EQ(scores[1].rows, 2);
  EXPECT_EQ(scores[2].group, "stranger");
  EXPECT_EQ(scores[2].rows, 0);
  EXPECT_EQ(scores[2].worst, 0);
  EXPECT_EQ(scores[3].group, "edit: cropped");
}

// Who says something of one row alone has not recognised the others.
TEST(ReadingScore, SilenceIsNoKnowledge) {
  const std::vector<ReadingRow> rows = SomeRows();
  Decisions decisions(rows.size());
  decisions[0].made = "classic";
  const ReadingScore score = ScoreReadings(rows, decisions)[0];
  EXPECT_EQ(score.named, 3);
  EXPECT_EQ(score.recognised, 1);
  EXPECT_EQ(score.intervals, 0);
}

TEST(ReadingScore, SaysWhatUntaggedSplatsAreTakenFor) {
  std::vector<ReadingRow> rows = SomeRows();
  rows[1].today.made.clear();
  rows[2].tag = RenderMode::kMip;  // it says so itself
  const auto counts = TakenFor(rows, TodaysDecisions(rows));
  ASSERT_EQ(counts.size(), 1u);
  EXPECT_EQ(counts.at("classic"), (std::map<std::string, int64_t>{{"classic", 1}, {"nothing", 1}}));
}

TEST(ReadingScore, BoundsAreAboveWhatIsDecided) {
  const std::vector<ReadingRow> rows = SomeRows();
  const double best = ScoreReadings(rows, BestDecisions(rows))[0].mean;
  EXPECT_NEAR(best, (4 + 5 + 0) / 3.0, 1e-12);  // what only loses is left alone
  double multiple = 0;
  const double fixed = ScoreReadings(rows, FixedDecisions(rows, "filter", multiple))[0].mean;
  EXPECT_EQ(multiple, 1);  // 4 + 1 − 2 and 2 + 3 − 2 and 0 + 5 − 2 are the same: the first
  EXPECT_NEAR(fixed, 1, 1e-12);
  EXPECT_GT(best, fixed);
}

// As of a program without a network.
TEST(ReadingScore, WhatWasNotMeasuredIsLeftAlone) {
  std::vector<ReadingRow> rows = SomeRows();
  for (ReadingRow& row : rows) row.gains.erase({RenderMode::kClassic, "network"});
  double multiple = 0;
  const ReadingScore score = ScoreReadings(rows, FixedDecisions(rows, "network", multiple))[0];
  EXPECT_EQ(score.rows, 3);
  EXPECT_EQ(score.mean, 0);
}

TEST(ReadingScore, GivenDecisionsAreWhatTheCurvesSay) {
  const std::vector<ReadingRow> rows = SomeRows();
  ReadingDecision decision;
  decision.method = "filter";
  decision.pixel = 0.7;
  const Decisions decisions = GivenDecisions(rows, {{"a", decision}});
  EXPECT_NEAR(ScoreReadings(rows, decisions)[0].mean, 3 / 3.0, 1e-12);  // the others are left alone
}

TEST(ReadingScore, WhatAFileSaysNobodyHasToRecognise) {
  std::vector<ReadingRow> rows = SomeRows();
  for (ReadingRow& row : rows) row.tag = RenderMode::kClassic;
  EXPECT_EQ(ScoreReadings(rows, TodaysDecisions(rows))[0].named, 0);
  // Nor is anybody accused by who says nothing.
  EXPECT_EQ(ScoreReadings(SomeRows(), BestDecisions(SomeRows()))[0].could_be_accused, 0);
}

TEST(ReadingScore, CurvesAreMeasuredAgainstWhatWasDecided) {
  std::vector<ReadingRow> rows = SomeRows();
  rows[0].today.pixel = 1;    // 4 by the curve, 3.5 measured
  rows[1].today.pixel = 0.7;  // 0 and −0.5
  rows[2].today.one_size = false;
  const CurveError error = ErrorOfCurves(rows);
  EXPECT_EQ(error.rows, 2);
  EXPECT_NEAR(error.median, 0.5, 1e-6);
  EXPECT_EQ(ErrorOfCurves({}).rows, 0);
}

TEST(ReadingScore, OfNoRowsIsZero) {
  const std::vector<ReadingScore> scores = ScoreReadings({}, {});
  ASSERT_EQ(scores.size(), 1u);
  EXPECT_EQ(scores[0].rows, 0);
  EXPECT_EQ(scores[0].mean, 0);
}

// Rows that only teach pixels judge no treatment, and refuse none.
TEST(ReadingTable, DecisionsOfRowsWithoutGainsAreTaken) {
  const TestFolder folder;
  const auto rows = Read(R"({"id":"b","kind":"standard","edit":"","made":"classic","tag":"classic","pixel":0.01})"
                         "\n" +
                         OneLine(kClassicRow));
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  const auto path = folder / "decisions.jsonl";
  ASSERT_TRUE(WriteWholeFile(path,
                             R"({"id":"b","method":"network","mode":"classic","pixel":0.01})"
                             "\n"
                             R"({"id":"a","method":"filter","mode":"classic","pixel":0.01,"gain":4.5})"
                             "\n",
                             true)
                  .ok());
  const auto decisions = ReadReadingDecisions(path, *rows);
  ASSERT_TRUE(decisions.ok()) << decisions.error().message;
  const ReadingScore score = ScoreReadings(*rows, GivenDecisions(*rows, *decisions))[0];
  EXPECT_EQ(score.rows, 1);
  EXPECT_DOUBLE_EQ(score.mean, 4.5) << "as it was measured, not the curve's 5";
}

// Fails where the model that is part of the program gets worse: of meshes that it has not seen, and what was to be had.
TEST(ReadingModel, DecidesWellAboutMeshesThatItHasNotSeen) {
  const auto file = TensorFile::Open(SourceDirForTest() / "models/reading.safetensors");
  ASSERT_TRUE(file.ok()) << file.error().message;
  std::istringstream names(file->metadata().at("held_out"));
  const std::set<std::string> held_out{std::istream_iterator<std::string>(names), {}};
  auto rows = ReadReadingTable(SourceDirForTest() / "data/reading.jsonl.gz");
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  std::erase_if(*rows, [&](const ReadingRow& row) { return !held_out.contains(row.mesh) || row.gains.empty(); });
  ASSERT_GT(rows->size(), 80u);
  const ReadingScore said = ScoreReadings(*rows, ReadDecisions(*rows, {&ReadingModel::Shipped(), 1}))[0];
  const ReadingScore best = ScoreReadings(*rows, BestDecisions(*rows))[0];
  EXPECT_GT(said.mean, 0.65 * best.mean) << best.mean;
  EXPECT_LT(said.losing, 0.06);
  EXPECT_GT(said.low, -0.7);
  EXPECT_GT(static_cast<double>(said.held), 0.65 * static_cast<double>(said.intervals));
  EXPECT_GT(static_cast<double>(said.recognised), 0.85 * static_cast<double>(said.named));
}

}  // namespace
}  // namespace anchorsplat

#include "train/trainer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/log.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "io/flip_bit_for_test.h"
#include "published/published_checkpoint.h"
#include "tensors/tensor_file.h"
#include "train/small_training_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using test::SmallTrainingSet;
using testing::HasSubstr;

// Small tensors: waking threads would cost more than the work.
const bool kOneThread = [] {
  SetThreadCount(1);
  return true;
}();

const SmallTrainingSet& Set() {
  static const SmallTrainingSet set;
  return set;
}

TrainRequest Request(const std::string& out, const fs::path& config) {
  TrainRequest request;
  request.datasets = {Set().train()};
  request.validation = {Set().validation()};
  request.config = config;
  request.out = Set() / out;
  return request;
}

std::vector<nlohmann::json> Log(const fs::path& folder) {
  std::vector<nlohmann::json> lines;
  std::ifstream file(folder / "log.jsonl");
  for (std::string line; std::getline(file, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

// Everything but the clock.
std::vector<nlohmann::json> Timeless(std::vector<nlohmann::json> lines) {
  for (nlohmann::json& line : lines) {
    line.erase("seconds");
    if (line.contains("validation")) line["validation"].erase("seconds");
  }
  return lines;
}

void ExpectSameTensors(const fs::path& a, const fs::path& b) {
  const auto first = TensorFile::Open(a), second = TensorFile::Open(b);
  ASSERT_TRUE(first.ok() && second.ok());
  ASSERT_EQ(first->tensors().size(), second->tensors().size());
  for (const TensorEntry& entry : first->tensors()) {
    const TensorEntry* other = second->Find(entry.name);
    ASSERT_NE(other, nullptr) << entry.name;
    EXPECT_EQ(*CopyContiguous(entry), *CopyContiguous(*other)) << entry.name;
  }
}

// Asks for an end once so many steps are done.
class StopAfter : public LogSink {
 public:
  StopAfter(int64_t steps, std::atomic<bool>& stop) : steps_(steps), stop_(stop) {}
  void Message(LogLevel, const std::string&) override {}
  void TaskBegin(const std::string& name, int64_t) override { training_ = name == "training"; }
  void TaskProgress(int64_t done, const std::string&) override {
    if (training_ && done >= steps_) stop_ = true;
  }
  void TaskEnd() override { training_ = false; }

 private:
  int64_t steps_;
  std::atomic<bool>& stop_;
  bool training_ = false;
};

constexpr const char* kPlain = R"(
[loss]
l1 = 1
ssim = 0.2
[optimizer]
learning_rate = 3e-3
clip = 2
ema = 0.9
warm_up = 4
[augmentation]
rotate = true
drop = 0.05
pixel_size_noise = 0.1
[validation]
every = 0
views = 2
)";

TEST(Trainer, ThePublishedNetworkLearnsFromItsZeroStart) {
  // Nothing is drawn but the order of objects and views, so that the loss's fall is not hidden behind other splats.
  TrainRequest request = Request("improves", Set().Config("improves.toml", R"(
[loss]
l1 = 1
ssim = 0.2
[optimizer]
learning_rate = 1e-2
clip = 2
[validation]
every = 0
views = 2
)"));
  request.steps = 60;
  const auto report = Train(request);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->steps, 60);
  EXPECT_EQ(report->skipped, 0);
  EXPECT_EQ(report->objects, 2);
  const auto log = Log(request.out);
  ASSERT_GT(log.size(), 60u);
  EXPECT_EQ(log.front()["step"], 0);
  ASSERT_TRUE(report->model && report->raw && report->filter);
  EXPECT_EQ(log.front()["validation"]["raw"]["psnr"].get<double>(), report->raw->psnr);
  EXPECT_GT(report->model->psnr, report->raw->psnr + 0.5);
  double early = 0, late = 0;
  for (size_t i = 1; i <= 20; ++i) early += log[i]["loss"].get<double>();
  for (size_t i = 41; i <= 60; ++i) late += log[i]["loss"].get<double>();
  EXPECT_LT(late, 0.85 * early);
  EXPECT_TRUE(fs::exists(request.out / "curve.html"));
  EXPECT_TRUE(fs::exists(request.out / "best.safetensors"));

  // The file is one that `enhance --model` opens, and says where it comes from.
  EXPECT_TRUE(LoadPublishedNetwork(report->file).ok());
  const auto file = TensorFile::Open(report->file);
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->metadata().at("object_names"), R"(["a","b"])");
  EXPECT_THAT(file->metadata().at("recipe"), HasSubstr("learning_rate = 1e-2"));

  // The folder is not taken for another training by mistake.
  EXPECT_EQ(Train(request).error().code, ErrorCode::kExists);
}

TEST(Trainer, TheCompactNetworkGetsBetterOnAnObjectItHasNotSeen) {
  const fs::path config = Set() / "compact.toml";
  std::ofstream(config) << R"(
log_every = 20
[network]
kind = "compact"
copies = 2
hidden = 16
head_hidden = 16
[loss]
l1 = 1
ssim = 0.2
[optimizer]
learning_rate = 1e-2
clip = 1
ema = 0.9
[data]
views_per_object = 6
[augmentation]
mirror = true
[validation]
every = 0
views = 2
)";
  TrainRequest request = Request("compact", config);
  request.steps = 80;
  const auto report = Train(request);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const double before = Log(request.out).front()["validation"]["model"]["psnr"].get<double>();
  EXPECT_GT(report->model->psnr, before + 0.3);
  EXPECT_GT(report->model->psnr, report->filter->psnr + 0.3);
  EXPECT_EQ(report->skipped, 0);
}

constexpr const char* kParts = R"(
log_every = 1
checkpoint_every = 0
[network]
kind = "compact"
copies = 2
hidden = 16
head_hidden = 16
[loss]
l1 = 1
ssim = 0.2
[optimizer]
learning_rate = 1e-2
clip = 1
ema = 0.9
[data]
views_per_object = 6
views_per_step = 3
crop = 48
part = 100
[augmentation]
mirror = true
[validation]
every = 0
views = 2
)";

// `more`: lines of [data].
void PartsTeachAndAreResumed(const std::string& name, const std::string& more) {
  const fs::path config = Set() / (name + ".toml");
  std::string text = kParts;
  text.insert(text.find("[augmentation]"), more);
  std::ofstream(config) << text;
  TrainRequest whole = Request(name + "_whole", config), parts = Request(name + "_parts", config);
  whole.steps = parts.steps = 80;
  const auto report = Train(whole);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->skipped, 0);
  const double before = Log(whole.out).front()["validation"]["model"]["psnr"].get<double>();
  EXPECT_GT(report->model->psnr, before + 0.1);

  std::atomic<bool> stop = false;
  const RunScope run({.stop = &stop});
  const auto sink = SetLogSink(std::make_shared<StopAfter>(33, stop));
  const auto first = Train(parts);
  SetLogSink(sink);
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_EQ(first->steps, 33);
  stop = false;
  parts.resume = true;
  const auto second = Train(parts);
  ASSERT_TRUE(second.ok()) << second.error().message;
  ExpectSameTensors(whole.out / "checkpoint.safetensors", parts.out / "checkpoint.safetensors");
  EXPECT_EQ(Timeless(Log(whole.out)), Timeless(Log(parts.out)));
}

TEST(Trainer, PartsTeachTheWholeAndAreResumedExactly) { PartsTeachAndAreResumed("part", ""); }

TEST(Trainer, MergedCopiesTeachAndAreResumedExactly) {
  PartsTeachAndAreResumed("merged", "least_merge_cost = 1e-4\ngreatest_merge_cost = 1e-1\n");
}

TEST(Trainer, ResumedIsTheSameAsUninterrupted) {
  const fs::path config = Set().Config("resume.toml", kPlain);
  TrainRequest whole = Request("whole", config), parts = Request("parts", config);
  whole.steps = parts.steps = 9;
  ASSERT_TRUE(Train(whole).ok());

  std::atomic<bool> stop = false;
  const RunScope run({.stop = &stop});
  const auto sink = SetLogSink(std::make_shared<StopAfter>(4, stop));
  const auto first = Train(parts);
  SetLogSink(sink);
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_TRUE(first->interrupted);
  EXPECT_EQ(first->steps, 4);
  EXPECT_TRUE(LoadPublishedNetwork(parts.out / "model.safetensors").ok()) << "what there was can be used";
  // A crash may leave more in the log than the checkpoint knows.
  std::ofstream(parts.out / "log.jsonl", std::ios::app) << R"({"step":5,"loss":1})"
                                                        << "\n{\"st";

  stop = false;
  parts.resume = true;
  const auto second = Train(parts);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(second->resumed_at, 4);
  EXPECT_EQ(second->steps, 9);
  ExpectSameTensors(whole.out / "checkpoint.safetensors", parts.out / "checkpoint.safetensors");
  ExpectSameTensors(whole.out / "model.safetensors", parts.out / "model.safetensors");
  EXPECT_EQ(Timeless(Log(whole.out)), Timeless(Log(parts.out)));

  FlipBit(parts.out / "checkpoint.safetensors", 5);
  EXPECT_THAT(Train(parts).error().message, HasSubstr("is damaged"));
  FlipBit(parts.out / "checkpoint.safetensors", 5);

  // Another recipe or other objects are another training.
  parts.seed = 3;
  EXPECT_THAT(Train(parts).error().message, HasSubstr("its seed is \"0\", this one's \"3\""));
  parts.seed.reset();
  parts.datasets.push_back(Set().validation());
  parts.validation.clear();
  EXPECT_THAT(Train(parts).error().message, HasSubstr("other objects: 2 then, 3 now"));

  // Its weights can begin another one.
  TrainRequest next = Request("next", config);
  next.steps = 1;
  next.start = whole.out / "checkpoint.safetensors";
  ASSERT_TRUE(Train(next).ok());
  const auto last = Log(whole.out).back()["validation"]["model"]["psnr"].get<double>();
  EXPECT_EQ(Log(next.out).front()["validation"]["model"]["psnr"].get<double>(), last);
}

TEST(Trainer, SaysWhatIsWrong) {
  const auto error = [&](const std::string& more) {
    TrainRequest request = Request("bad", Set().Config("bad.toml", more));
    request.steps = 1;
    const auto report = Train(request);
    return report.ok() ? std::string("no error") : report.error().message;
  };
  EXPECT_THAT(error("[optimizer.groups]\nbackbon = 1e-3\n"),
              HasSubstr("bad.toml: optimizer.groups.backbon: the network \"anchorsplat\" has no such group; it has "
                        "backbone, features_dc"));
  EXPECT_THAT(error("part = 100\n"), HasSubstr("data.part: this network needs the whole splat"));
  TrainRequest request = Request("bad", Set() / "bad.toml");
  std::ofstream(request.config) << "[network]\nkind = \"anchorsplat\"\ncopies = 0\n";
  EXPECT_THAT(Train(request).error().message,
              HasSubstr("bad.toml: line 3: network.copies: expected a whole number from 1 to 256"));
  std::ofstream(request.config) << "[network]\nkind = \"perceptron\"\n";
  EXPECT_THAT(Train(request).error().message, HasSubstr("bad.toml: line 2: network.kind: unknown network"));
  request.datasets = {Set() / "nowhere"};
  EXPECT_EQ(Train(request).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace anchorsplat

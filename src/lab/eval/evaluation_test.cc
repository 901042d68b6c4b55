#include "eval/evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>

#include "cameras/camera_io.h"
#include "cameras/colmap_writer.h"
#include "core/text.h"
#include "enhance/enhance.h"
#include "eval/contact_sheet.h"
#include "formats/gsplat_checkpoint/gsplat_checkpoint_writer.h"
#include "formats/random_cloud_for_test.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"
#include "upscale/small_upscaler_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A cloud around the origin that renders to something.
GaussianCloud Ball() {
  GaussianCloud cloud = RandomCloud(200, 1, 4);
  for (int64_t i = 0; i < cloud.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const size_t k = static_cast<size_t>(3 * i + axis);
      cloud.means[k] = 0.4f * std::sin(1.7f * static_cast<float>(i) + 2.0f * static_cast<float>(axis));
      cloud.log_scales[k] = -3.2f + 0.3f * std::cos(static_cast<float>(i));
    }
    cloud.opacity_logits[static_cast<size_t>(i)] = 1;
  }
  return cloud;
}

// Cameras named 000, 001, … with pictures of `cloud` in folder/pictures.
CameraSet Photograph(const GaussianCloud& cloud, int count, int size, const fs::path& folder,
                     const std::string& pictures) {
  CameraSet cameras = *OrbitCameras(count, 1.7, {0, 0, 0}, PinholeFromFov(size, size, 0.8));
  fs::create_directories(folder / pictures);
  Rasterizer rasterizer;
  for (Camera& camera : cameras.cameras) {
    RenderOutput output;
    EXPECT_TRUE(rasterizer.Render(cloud, camera, {}, output).ok());
    const std::string file = Cat(pictures, "/", camera.name, ".png");
    EXPECT_TRUE(WritePng(folder / file, output.color).ok());
    camera.image = folder / file;
  }
  return cameras;
}

// The published layout with 9 views of 16² and 48².
void MakePublishedObject(const fs::path& folder, const GaussianCloud& low, const GaussianCloud& truth) {
  CameraSet high = Photograph(truth, 9, 48, folder / "48", "images");
  CameraSet small = Photograph(low, 9, 16, folder / "16", "images");
  std::reverse(high.cameras.begin(), high.cameras.end());  // in another order than that of the names
  std::reverse(small.cameras.begin(), small.cameras.end());
  fs::create_directories(folder / "16" / "sparse" / "0");
  fs::create_directories(folder / "16" / "gaussian_splatting" / "ckpts");
  ASSERT_TRUE(WriteColmapCameras(folder / "48", high, ColmapForm::kText).ok());
  ASSERT_TRUE(WriteColmapCameras(folder / "16" / "sparse" / "0", small, ColmapForm::kBinary).ok());
  std::vector<ColmapPoint> points(50);
  for (size_t i = 0; i < points.size(); ++i) {
    const double at = static_cast<double>(i);
    points[i] = {{0.4 * std::sin(at), 0.4 * std::cos(2 * at), 0.4 * std::sin(3 * at)}, {200, 150, 100}};
  }
  ASSERT_TRUE(WriteColmapPoints(folder / "16" / "sparse" / "0", points, ColmapForm::kBinary).ok());
  const fs::path checkpoints = folder / "16" / "gaussian_splatting" / "ckpts";
  ASSERT_TRUE(WriteGsplatCheckpoint(checkpoints / "ckpt_14999_rank0.pt", low, 14999).ok());
  std::ofstream(checkpoints / "ckpt_3499_rank0.pt") << "an earlier one, which is not read";
}

// The layout of the examples: 4 high views, of which 002 was trained on.
void MakeExampleObject(const fs::path& folder, const GaussianCloud& low, const GaussianCloud& truth) {
  const CameraSet high = Photograph(truth, 4, 48, folder, "hr");
  const auto named = [](CameraSet set, const std::string& folder_name) {
    for (Camera& camera : set.cameras) camera.name = folder_name + "/" + camera.name;
    return set;
  };
  CameraSet trained;
  trained.cameras = {high.cameras[2]};
  trained.cameras[0].intrinsics = Scaled(trained.cameras[0].intrinsics, 1.0 / 3);
  ASSERT_TRUE(WriteTransforms(folder / "transforms_hr.json", named(high, "hr")).ok());
  ASSERT_TRUE(WriteTransforms(folder / "transforms_lr.json", named(trained, "lr")).ok());
  ASSERT_TRUE(WriteCloud(folder / "input.ply", low).ok());
}

// The truth is the ball, the low-quality splat a thinner one.
GaussianCloud ThinBall() {
  GaussianCloud cloud = Ball();
  for (float& value : cloud.log_scales) value -= 0.4f;
  return cloud;
}

std::vector<EvalMethod> Methods(const std::vector<std::string>& words) {
  std::vector<EvalMethod> methods;
  for (const std::string& word : words) {
    auto method = MakeEvalMethod(word, {});
    EXPECT_TRUE(method.ok()) << word << ": " << method.error().message;
    methods.push_back(*std::move(method));
  }
  return methods;
}

TEST(Benchmark, ReadsThePublishedLayout) {
  const TestFolder folder;
  MakePublishedObject(folder / "ball", ThinBall(), Ball());
  const auto entries = ListBenchmark(folder.path());
  ASSERT_TRUE(entries.ok()) << entries.error().message;
  ASSERT_EQ(entries->size(), 1u);
  EXPECT_EQ(entries->front().name, "ball");
  const auto object = OpenObject(entries->front());
  ASSERT_TRUE(object.ok()) << object.error().message;
  EXPECT_DOUBLE_EQ(object->upscale(), 3);
  EXPECT_EQ(object->low.size(), 200);
  EXPECT_THAT(object->held_out, ElementsAre(0, 8));
  ASSERT_EQ(object->views.size(), 9u);
  EXPECT_EQ(object->views[0].name, "000");  // sorted
  EXPECT_EQ(object->views[8].name, "008");
  EXPECT_EQ(object->LowCamera(3).intrinsics.width, 16);
  EXPECT_EQ(object->LowCamera(3).name, "003");
  // The pictures belong to the cameras: the truth rendered again differs by rounding only.
  Rasterizer rasterizer;
  RenderOutput output;
  ASSERT_TRUE(rasterizer.Render(Ball(), object->views[5], {}, output).ok());
  const Image truth = object->Truth(5)->image;
  for (size_t i = 0; i < truth.pixels.size(); ++i) {
    ASSERT_NEAR(std::min(1.0f, output.color.pixels[i]), truth.pixels[i], 0.003);
  }
  // A folder that is itself an object is a benchmark of one.
  EXPECT_EQ(ListBenchmark(folder / "ball")->front().name, "ball");
}

TEST(Benchmark, ReadsTheExamplesLayout) {
  const TestFolder folder;
  MakeExampleObject(folder / "ball", ThinBall(), Ball());
  const auto object = OpenObject(ListBenchmark(folder.path())->front());
  ASSERT_TRUE(object.ok()) << object.error().message;
  EXPECT_THAT(object->held_out, ElementsAre(0, 1, 3));
  EXPECT_DOUBLE_EQ(object->upscale(), 3);
}

TEST(Benchmark, NamesWhatIsMissing) {
  const TestFolder folder;
  EXPECT_EQ(ListBenchmark(folder / "nothing").error().code, ErrorCode::kNotFound);
  EXPECT_THAT(ListBenchmark(folder.path()).error().message, HasSubstr("transforms_hr.json"));
  MakePublishedObject(folder / "ball", ThinBall(), Ball());
  const BenchmarkEntry entry = ListBenchmark(folder.path())->front();
  fs::rename(entry.folder / "48" / "images" / "004.png", entry.folder / "other.png");
  EXPECT_THAT(OpenObject(entry)->Truth(4).error().message, HasSubstr("neither the high-resolution picture 004"));
  EXPECT_TRUE(OpenObject(entry)->Truth(3).ok());
  fs::rename(entry.folder / "other.png", entry.folder / "48" / "images" / "004.png");
  fs::remove_all(entry.folder / "16" / "gaussian_splatting");
  EXPECT_THAT(OpenObject(entry).error().message, HasSubstr("ckpt_*_rank0.pt"));
}

TEST(Evaluate, MeasuresResumesAndGoesOnAfterFailures) {
  const TestFolder folder, out;
  MakePublishedObject(folder / "a_published", ThinBall(), Ball());
  MakeExampleObject(folder / "b_example", Ball(), Ball());
  MakeExampleObject(folder / "c_broken", Ball(), Ball());
  std::ofstream(folder / "c_broken/hr/000.png") << "no picture";
  MakeExampleObject(folder / "d_empty", Ball(), Ball());
  std::ofstream(folder / "d_empty/input.ply") << "no splat";

  int calls = 0;
  std::vector<EvalMethod> methods = Methods({"raw", "filter", "upsample", "filter-best"});
  methods.push_back({"picky", "", [&](const MethodTask& task) -> Result<MethodViews> {
                       ++calls;
                       if (task.object.name == "b_example") return Error{ErrorCode::kBadArgument, "not this one"};
                       return SplatViews(task.object, task.object.low);
                     }});
  const auto evaluation = Evaluate(folder.path(), methods, out.path(), {});
  ASSERT_TRUE(evaluation.ok()) << evaluation.error().message;
  EXPECT_THAT(evaluation->objects, ElementsAre("a_published", "b_example", "c_broken", "d_empty"));
  ASSERT_EQ(evaluation->results.size(), 5u + 4u);
  ASSERT_EQ(evaluation->failures.size(), 4u);
  EXPECT_EQ(evaluation->failures[0].object, "b_example");
  EXPECT_EQ(evaluation->failures[0].method, "picky");
  EXPECT_EQ(evaluation->failures[0].message, "not this one");
  // "filter-best" looks at the truth by itself, the object fails for all.
  EXPECT_EQ(evaluation->failures[1].method, "filter-best");
  EXPECT_EQ(evaluation->failures[2].object, "c_broken");
  EXPECT_EQ(evaluation->failures[2].method, "");
  EXPECT_THAT(evaluation->failures[2].message, HasSubstr("000.png"));
  EXPECT_EQ(evaluation->failures[3].object, "d_empty");
  EXPECT_EQ(calls, 3);

  // The same splat measures only the rounding of the pictures; the thin one is worse, and the filter helps it.
  EXPECT_GT(evaluation->Find("b_example", "raw")->MeanPsnr(), 50);
  const double raw = evaluation->Find("a_published", "raw")->MeanPsnr();
  EXPECT_LT(raw, 40);
  EXPECT_GT(evaluation->Find("a_published", "filter")->MeanPsnr(), raw);
  EXPECT_GE(evaluation->Find("a_published", "filter-best")->MeanPsnr(),
            evaluation->Find("a_published", "filter")->MeanPsnr() - 0.01);
  EXPECT_EQ(evaluation->Find("a_published", "picky")->MeanPsnr(), raw);
  EXPECT_LT(evaluation->Find("b_example", "upsample")->MeanPsnr(), 40);
  EXPECT_EQ(evaluation->Find("a_published", "raw")->views.size(), 2u);
  EXPECT_EQ(evaluation->Find("a_published", "raw")->views[1].name, "008");

  const auto sheet = ContactSheet(out.path(), *evaluation);
  ASSERT_TRUE(sheet.ok()) << sheet.error().message;
  EXPECT_GT(sheet->width, 6 * 256);

  // Once more: all that succeeded is there already, with the same numbers.
  const auto again = Evaluate(folder.path(), methods, out.path(), {});
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->resumed, 9);
  EXPECT_EQ(again->times.pictures, 0);
  EXPECT_EQ(again->failures.size(), 4u);
  EXPECT_EQ(again->Find("a_published", "raw")->MeanPsnr(), raw);
  // Another protocol, a splat that changed and a damaged result are measured again.
  const auto upstream = Evaluate(folder.path(), Methods({"raw"}), out.path(), {.protocol = Protocol::kUpstream});
  EXPECT_EQ(upstream->resumed, 0);
  EXPECT_EQ(upstream->Find("a_published", "raw")->views.size(), 3u);  // 9 − 6
  std::ofstream(out / "objects/a_published/filter.json") << "{\"key\": 1}";
  ASSERT_TRUE(WriteCloud(folder / "b_example/input.ply", ThinBall(), {.overwrite = true}).ok());
  const auto changed = Evaluate(folder.path(), Methods({"raw", "filter"}), out.path(), {.objects = {"b_example"}});
  EXPECT_EQ(changed->resumed, 0);
  EXPECT_LT(changed->Find("b_example", "raw")->MeanPsnr(), 40);
  EXPECT_EQ(Evaluate(folder.path(), Methods({"filter"}), out.path(), {.objects = {"a_published"}})->resumed, 0);
}

// Licences ask for it wherever an object is shown.
TEST(Evaluate, ContactSheetsCarryCredits) {
  const TestFolder folder, out;
  GaussianCloud low = ThinBall();
  MakeExampleObject(folder / "a_ball", low, Ball());
  MakeExampleObject(folder / "b_ball", low, Ball());
  const auto sheet_of = [&](const EvaluationOptions& options) {
    const auto evaluation = Evaluate(folder.path(), Methods({"raw"}), out.path(), options);
    EXPECT_TRUE(evaluation.ok() && evaluation->failures.empty());
    return *ContactSheet(out.path(), *evaluation);
  };
  const Image plain = sheet_of({.objects = {"a_ball"}}), plain_both = sheet_of({});
  low.comments = {"world up: 0 1 0", "credit: Ball by Ann, CC BY 4.0"};
  for (const char* name : {"a_ball", "b_ball"}) {
    ASSERT_TRUE(WriteCloud(folder / name / "input.ply", low, {.overwrite = true}).ok());
  }
  const Image one = sheet_of({.objects = {"a_ball"}}), both = sheet_of({});
  const auto ink = [](const Image& image, int from) {
    return std::count_if(image.channel(0) + int64_t{from} * image.width, image.channel(0) + image.plane(),
                         [](float x) { return x > 0.5f; });
  };
  ASSERT_GT(one.height, plain.height);
  EXPECT_GT(ink(one, plain.height), 100);
  EXPECT_EQ(both.height - plain_both.height, one.height - plain.height) << "one text for both";
  EXPECT_GT(ink(both, plain_both.height), ink(one, plain.height)) << "with the names of the objects";
}

TEST(EvalMethods, RefinementTakesOptions) {
  const TestFolder folder, out;
  MakePublishedObject(folder / "ball", ThinBall(), Ball());
  const std::string few = "refine@steps=2@k=2@f=0.5", one = "refine-images@steps=2@k=1",
                    longer = "refine@steps=3@k=1@f=0.5";
  const auto evaluation = Evaluate(folder.path(), Methods({few, one, longer}), out.path(), {});
  ASSERT_TRUE(evaluation.ok() && evaluation->failures.empty());
  EXPECT_THAT(evaluation->methods, ElementsAre(few, one, longer)) << "as they were written";
  EXPECT_EQ(evaluation->Find("ball", few)->facts.at("steps"), FactValue(int64_t{2}));
  EXPECT_EQ(evaluation->Find("ball", longer)->facts.at("steps"), FactValue(int64_t{3}));
  EXPECT_LE(evaluation->Find("ball", one)->gaussians, 200);
  EXPECT_GE(NumberOf(evaluation->Find("ball", one)->facts.at("processor_seconds")), 0);
  EXPECT_TRUE(fs::exists(ObjectFolder(out.path(), "ball") / "refine@steps_2@k_2@f_0.5.json"));
  EXPECT_EQ(Evaluate(folder.path(), Methods({few, one, longer}), out.path(), {})->resumed, 3);

  const std::string alone = "refine-auto@steps=2@k=1";
  const auto read = Evaluate(folder.path(), Methods({alone}), out.path(), {});
  ASSERT_TRUE(read.ok() && read->failures.empty());
  EXPECT_GT(NumberOf(read->Find("ball", alone)->facts.at("pixel_size_ratio")), 0);

  const auto error = [](const std::string& word) {
    const auto method = MakeEvalMethod(word, {});
    return method.ok() ? std::string() : method.error().message;
  };
  EXPECT_EQ(error("refine"), "");
  EXPECT_EQ(error("filter+refine@rate=0.5"), "");
  const fs::path network = out / "network.safetensors";
  ASSERT_TRUE(RepeatingForTest().Write(network).ok());
  EXPECT_EQ(error(network.string()), "") << "as `upsample`";
  EXPECT_EQ(error("detail@enlarge-with=" + network.string()), "");
  EXPECT_THAT(error("detail@enlarge-with=none.safetensors"), HasSubstr("no such file"));
  EXPECT_EQ(error("detail"), "");
  EXPECT_THAT(error("refine@speed=1"), HasSubstr("ssim-weight"));
  EXPECT_THAT(error("refine@k=x"), HasSubstr("k cannot be 'x'"));
  EXPECT_THAT(error("refine@k=0"), HasSubstr("whole number from 1 to 64"));
  EXPECT_THAT(error("refine@f=-1"), HasSubstr("f must be a number"));
  EXPECT_THAT(error("refine@k=1@k=2"), HasSubstr("each once"));
  EXPECT_THAT(error("refine@"), HasSubstr("KEY=VALUE"));
  EXPECT_THAT(error("refine-images@hold-out=0"), HasSubstr("benchmark"));
  EXPECT_EQ(error("model@merge-cost=0.001@max-gaussians=100"), "");
  EXPECT_EQ(error("model@copies=auto"), "");
  EXPECT_THAT(error("model@copies=0"), HasSubstr("'0' is neither 'auto' nor"));
  EXPECT_THAT(error("model@merge-cost=-1"), HasSubstr("merge-cost cannot be '-1': it must be a number of 0 or more"));
  EXPECT_THAT(error("model@copies=2@merge-cost=1"), HasSubstr("--merge-cost has no effect"));
  EXPECT_THAT(error("model@precision=fp8"), HasSubstr("it must be fp32 or bf16"));
  EXPECT_THAT(error("refine@most-gaussians=9@max-gaussians=9"), HasSubstr("each once"));
  EXPECT_THAT(error("filter+raw@k=1"), HasSubstr("is not raw"));
  EXPECT_THAT(error("refine-images-auto"), HasSubstr("-auto has no effect"));
  EXPECT_THAT(error("raw-auto"), HasSubstr("is not raw"));
}

// What was kept counts for the truth, the pictures and the cameras that it was measured with.
TEST(Evaluate, MeasuresAgainWhatPicturesOrCamerasHaveChangedFor) {
  const TestFolder folder, out;
  const fs::path object = folder / "ball";
  MakePublishedObject(object, Ball(), ThinBall());
  const auto resumed = [&] {
    const auto evaluation = Evaluate(folder.path(), Methods({"raw"}), out.path(), {});
    EXPECT_TRUE(evaluation.ok() && evaluation->failures.empty());
    return evaluation->resumed;
  };
  EXPECT_EQ(resumed(), 0);
  EXPECT_EQ(resumed(), 1);
  int changed = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder.path())) {
    const std::string name = entry.path().filename().string();
    if (name != "000.png" && name != "cameras.txt") continue;
    // A minute later than it was made: another file, for all that anyone knows.
    fs::last_write_time(entry.path(), entry.last_write_time() + std::chrono::minutes(1));
    if (name == "cameras.txt") {
      std::ifstream in(entry.path());
      std::string text((std::istreambuf_iterator<char>(in)), {});
      const size_t at = text.find(" 24 24\n");
      ASSERT_NE(at, std::string::npos) << text;
      text.insert(at + 3, ".5");  // of the principal point
      std::ofstream(entry.path()) << text;
    }
    EXPECT_EQ(resumed(), 0) << entry.path();
    EXPECT_EQ(resumed(), 1) << entry.path();
    ++changed;
  }
  EXPECT_EQ(changed, 3);
}

TEST(Evaluate, BicubicFitsAnewAndGoesOnWhereItWasStopped) {
  const TestFolder folder, out;
  MakePublishedObject(folder / "ball", Ball(), Ball());
  const auto method = MakeEvalMethod("bicubic", {.filter_strength = std::nullopt, .fit_steps = 12});
  ASSERT_TRUE(method.ok());
  const auto fitted = Evaluate(folder.path(), {*method}, out.path(), {});
  ASSERT_TRUE(fitted.ok()) << fitted.error().message;
  ASSERT_TRUE(fitted->failures.empty()) << fitted->failures[0].message;
  ASSERT_EQ(fitted->results.size(), 1u);
  EXPECT_GT(fitted->results[0].gaussians, 0);
  EXPECT_GT(NumberOf(fitted->results[0].facts.at("train_psnr")), 5);
  // The result is measured again, the fit only read.
  const fs::path cache = out / "objects/ball/bicubic";
  const auto written = fs::last_write_time(cache / "splat.ply");
  EXPECT_FALSE(fs::exists(cache / "pictures"));
  const auto again = Evaluate(folder.path(), {*method}, out.path(), {.again = true});
  EXPECT_EQ(again->resumed, 0);
  EXPECT_EQ(again->results[0].MeanPsnr(), fitted->results[0].MeanPsnr());
  EXPECT_EQ(again->results[0].seconds, fitted->results[0].seconds);
  EXPECT_EQ(fs::last_write_time(cache / "splat.ply"), written);
  // Another number of steps is another fit; a damaged note begins anew.
  std::ofstream(cache / "fit.json") << "{}";
  const auto anew = Evaluate(folder.path(), {*method}, out.path(), {.again = true});
  ASSERT_EQ(anew->results.size(), 1u);
  EXPECT_NE(fs::last_write_time(cache / "splat.ply"), written);
  EXPECT_EQ(anew->results[0].MeanPsnr(), fitted->results[0].MeanPsnr());
}

TEST(Evaluate, RefusesWhatCannotBeMeant) {
  const TestFolder folder, out;
  MakeExampleObject(folder / "ball", Ball(), Ball());
  EXPECT_EQ(Evaluate(folder.path(), {}, out.path(), {}).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(Evaluate(folder.path(), Methods({"raw", "raw"}), out.path(), {}).error().code, ErrorCode::kBadArgument);
  EXPECT_THAT(Evaluate(folder.path(), Methods({"raw"}), out.path(), {.objects = {"bell"}}).error().message,
              HasSubstr("bell"));
  EXPECT_FALSE(MakeEvalMethod("no-such-method", {}).ok());
  EXPECT_FALSE(MakeEvalMethod("filter@x", {}).ok());
  EXPECT_FALSE(MakeEvalMethod("filter@-1", {}).ok());
  EXPECT_EQ(MakeEvalMethod("no-such-file.safetensors", {}).error().code, ErrorCode::kNotFound);
}

TEST(Evaluate, MethodsOfEnhanceComeByThemselves) {
  std::vector<EnhanceMethod> methods = BasicMethods();
  methods.push_back(
      {.name = "thicken",
       .summary = "for this test",
       .options = {},
       .ready = [](const EnhanceOptions&) { return Status(); },
       .run = [](EnhanceInput input, const EnhanceOptions& options, StepReport& report) -> Result<GaussianCloud> {
         EXPECT_TRUE(options.cameras);
         for (float& value : input.cloud.log_scales) value += 0.4f;
         report.facts = {{"by", 0.4}};
         return std::move(input.cloud);
       }});
  const auto thicken = MakeEvalMethod("thicken", {.filter_strength = std::nullopt, .enhance_methods = &methods});
  ASSERT_TRUE(thicken.ok()) << thicken.error().message;
  const TestFolder folder, out;
  GaussianCloud thin = ThinBall();
  thin.render_mode = RenderMode::kClassic;
  MakeExampleObject(folder / "ball", thin, Ball());
  const auto evaluation = Evaluate(folder.path(), {*thicken}, out.path(), {});
  ASSERT_TRUE(evaluation.ok()) << evaluation.error().message;
  ASSERT_EQ(evaluation->results.size(), 1u);
  EXPECT_GT(evaluation->results[0].MeanPsnr(), 50);
  EXPECT_EQ(evaluation->results[0].facts.at("by"), FactValue(0.4));
}

TEST(MethodResult, RoundTrip) {
  const TestFolder folder;
  MethodResult result;
  result.object = "o";
  result.method = "m";
  result.views = {{"a", 31.25, 0.5, 0.125}, {"b", std::numeric_limits<double>::infinity(), 1, std::nullopt}};
  result.seconds = 1.5;
  result.gaussians = 12;
  result.facts = {{"f", 0.74}, {"whole", 2.0}, {"steps", int64_t{2}}, {"kept_start", true}};
  ASSERT_TRUE(WriteMethodResult(folder / "m.json", "key", result).ok());
  EXPECT_FALSE(ReadMethodResult(folder / "m.json", "another key"));
  EXPECT_FALSE(ReadMethodResult(folder / "none.json", "key"));
  const auto read = ReadMethodResult(folder / "m.json", "key");
  ASSERT_TRUE(read);
  ASSERT_EQ(read->views.size(), 2u);
  EXPECT_EQ(read->views[0].lpips, 0.125);
  EXPECT_TRUE(std::isinf(read->views[1].psnr));
  EXPECT_EQ(read->MeanLpips(), std::nullopt);
  EXPECT_EQ(read->gaussians, 12);
  EXPECT_EQ(read->facts, result.facts);
}

}  // namespace
}  // namespace anchorsplat

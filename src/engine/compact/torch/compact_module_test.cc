#include "compact/torch/compact_module.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numeric>
#include <span>

#include "compact/compact_network.h"
#include "compact/sheet_cloud_for_test.h"
#include "compact/torch/compact_trainable.h"
#include "core/rotation.h"
#include "core/spherical_harmonics.h"
#include "enhance/filter.h"
#include "io/folder_for_test.h"
#include "metrics/image_metrics.h"
#include "render/rasterizer.h"

namespace anchorsplat {
namespace {

using torch::Tensor;

const bool kOneThread = [] {
  torch::set_num_threads(1);
  return true;
}();

Tensor Table(const Buffer<float>& values, std::vector<int64_t> shape) {
  return torch::from_blob(const_cast<float*>(values.data()), shape, torch::kFloat32).clone();
}

NetworkInput InputOf(const GaussianCloud& cloud, double pixel_size = kSheetPixel) {
  NetworkInput input;
  input.gaussians = ToTensors(cloud);
  input.pixel_sizes = torch::full({cloud.size()}, pixel_size);
  return input;
}

GaussianTensors Copies(CompactTrainable& network, NetworkInput input) {
  auto prepared = network.Prepare(input);
  EXPECT_TRUE(prepared.ok()) << prepared.error().message;
  input.prepared = *prepared;
  return network.Forward(input);
}

void ExpectNear(const Buffer<float>& a, const Buffer<float>& b, double tolerance, const char* what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  for (size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], tolerance) << what << " " << i;
}

void ExpectNear(const GaussianCloud& a, const GaussianCloud& b, double tolerance) {
  ExpectNear(a.means, b.means, tolerance, "means");
  ExpectNear(a.log_scales, b.log_scales, tolerance, "log_scales");
  ExpectNear(a.quats, b.quats, tolerance, "quats");
  ExpectNear(a.opacity_logits, b.opacity_logits, tolerance, "opacity_logits");
  ExpectNear(a.sh, b.sh, tolerance, "sh");
}

std::vector<CompactConfig> Configs() {
  std::vector<CompactConfig> configs(6);
  configs[0].copies = 1;
  configs[0].spread = 0;
  configs[1].offset_unit = OffsetUnit::kPixel;
  configs[2].copies = 2;
  configs[2].rounds = 0;
  configs[2].sh = false;
  configs[2].offset_unit = OffsetUnit::kCube;
  configs[2].epsilon = 0.015;
  configs[3].prior = false;
  configs[3].anchors = false;
  configs[3].neighbours = 20;
  configs[4].copies = 5;
  configs[4].hidden = 48;
  configs[4].head_hidden = 32;
  configs[4].context = CompactContext::kPatches;
  configs[5].knows_kind = true;
  return configs;
}

TEST(CompactModule, InferenceIsTheSameFunction) {
  for (const CompactConfig& config : Configs()) {
    for (const auto& [count, degree] : {std::pair{200, 3}, {150, 1}, {9, 0}, {2, 2}, {1, 3}}) {
      SCOPED_TRACE(testing::Message() << "K " << config.copies << ", " << count << " Gaussians of degree " << degree);
      GaussianCloud cloud = SheetCloud(count, degree);
      cloud.log_scales[1] = -std::numeric_limits<float>::infinity();
      std::fill_n(cloud.quats.begin(), 4, 0.0f);
      CompactTrainable network(config);
      network.eval();
      ASSERT_TRUE(network.SetWeights(OpenDomain()).ok());
      const torch::NoGradGuard no_gradient;
      const GaussianCloud expected = ToCloud(Copies(network, InputOf(cloud)));

      const auto packed = CompactNetwork::Load(config, network.Weights());
      ASSERT_TRUE(packed.ok()) << packed.error().message;
      const float pixel = kSheetPixel;
      const auto result =
          packed->Apply(cloud, {.pixel_sizes = {&pixel, 1}, .upscale = 4, .strength = DefaultFilterStrength(4)});
      ASSERT_TRUE(result.ok()) << result.error().message;
      EXPECT_EQ(result->unlike_training, 0);
      if (!config.prior) {  // −Inf, which has no difference
        for (GaussianCloud* c : {const_cast<GaussianCloud*>(&expected), const_cast<GaussianCloud*>(&result->cloud)}) {
          for (float& s : c->log_scales) s = std::max(s, -100.0f);
        }
      }
      ExpectNear(result->cloud, expected, 1e-5);
    }
  }
}

Image Render(const GaussianCloud& cloud) {
  Camera camera;
  camera.intrinsics.width = camera.intrinsics.height = 400;
  camera.intrinsics.fx = camera.intrinsics.fy = 400;
  camera.intrinsics.cx = camera.intrinsics.cy = 200;
  camera.world_to_camera.translation = {0, 0, 1};  // the sheet is a unit in front of it
  Rasterizer rasterizer;
  RenderOutput output;
  const Status status = rasterizer.Render(cloud, camera, {}, output);
  EXPECT_TRUE(status.ok());
  return output.color;
}

// Told of the render mode and of another strength, both forms hear the same, and what they hear matters.
TEST(CompactModule, HearsTheKindOfSplat) {
  CompactConfig config;
  config.knows_kind = true;
  CompactTrainable network(config);
  network.eval();
  ASSERT_TRUE(network.SetWeights(OpenDomain()).ok());
  const auto packed = CompactNetwork::Load(config, network.Weights());
  ASSERT_TRUE(packed.ok()) << packed.error().message;
  const torch::NoGradGuard no_gradient;
  const float pixel = kSheetPixel;
  GaussianCloud cloud = SheetCloud(100), last;
  for (const RenderMode mode : kRenderModes) {
    cloud.render_mode = mode;
    NetworkInput input = InputOf(cloud);
    input.mode = mode;
    input.strength = 0.4;
    const GaussianCloud expected = ToCloud(Copies(network, input));
    const auto result = packed->Apply(cloud, {.pixel_sizes = {&pixel, 1}, .upscale = 4, .strength = 0.4});
    ASSERT_TRUE(result.ok()) << result.error().message;
    ExpectNear(result->cloud, expected, 1e-5);
    EXPECT_EQ(result->cloud.render_mode, mode);
    EXPECT_NE(result->cloud.means, last.means);
    last = result->cloud;
  }
}

// A network that was told less goes on with what it knows: what is new says nothing at first, and nobody knows its
// range.
TEST(CompactModule, LearnsOfTheKindLater) {
  const TestFolder folder;
  CompactConfig config;
  CompactTrainable before(config);
  ASSERT_TRUE(before.SetWeights(OpenDomain()).ok());
  const auto file = folder / "before.safetensors";
  ASSERT_TRUE(before.Save(file, {}).ok());
  config.knows_kind = true;
  CompactTrainable after(config);
  ASSERT_TRUE(after.InitialiseFrom(file).ok());
  const torch::NoGradGuard no_gradient;
  before.eval();
  after.eval();
  NetworkInput input = InputOf(SheetCloud(100));
  ExpectNear(ToCloud(Copies(after, input)), ToCloud(Copies(before, input)), 1e-6);
  const auto packed = CompactNetwork::Load(config, after.Weights());
  ASSERT_TRUE(packed.ok()) << packed.error().message;
  EXPECT_FALSE(packed->HasTrainingRange());
}

TEST(CompactModule, BeginsAtTheFilter) {
  const GaussianCloud cloud = SheetCloud(3000);
  GaussianCloud filtered = cloud;
  const float pixel = kSheetPixel;
  ASSERT_TRUE(ApplyFilter(filtered, {&pixel, 1}, {.upscale = 4, .strength = {}}).ok());
  const Image expected = Render(filtered);
  // Copies multiply to almost what one lets through, not exactly: see CopyStart.
  for (const auto& [copies, spread, psnr] :
       {std::tuple{1, 0.0, 60.0}, {2, 0.5, 36.0}, {4, 0.0, 36.0}, {4, 0.5, 36.0}, {20, 0.5, 32.0}}) {
    CompactConfig config;
    config.copies = copies;
    config.spread = spread;
    CompactTrainable network(config);
    const torch::NoGradGuard no_gradient;
    const GaussianCloud start = ToCloud(Copies(network, InputOf(cloud)));
    const auto measured = Psnr(Render(start), expected);
    ASSERT_TRUE(measured.ok());
    EXPECT_GT(*measured, psnr) << copies << " copies, spread " << spread;
  }
}

// The coefficients whose colour in direction R·d is that of `sh` in direction d, degree by degree.
void TurnSphericalHarmonics(GaussianCloud& cloud, const Tensor& rotation) {
  torch::manual_seed(3);
  const Tensor from = torch::nn::functional::normalize(torch::randn({40, 3}, torch::kFloat64)),
               to = from.matmul(rotation.t());
  const auto basis = [](const Tensor& directions) {
    Tensor out = torch::empty({directions.size(0), 16}, torch::kFloat64);
    for (int64_t i = 0; i < directions.size(0); ++i) {
      const auto values =
          ShBasis(directions[i][0].item<double>(), directions[i][1].item<double>(), directions[i][2].item<double>());
      for (int64_t k = 0; k < 16; ++k) out[i][k] = values[static_cast<size_t>(k)];
    }
    return out;
  };
  const Tensor y_from = basis(from), y_to = basis(to);
  const int64_t n = cloud.size();
  Tensor sh = Table(cloud.sh, {n, cloud.coefficients(), 3}).to(torch::kFloat64);
  for (int64_t degree = 1; degree <= cloud.sh_degree; ++degree) {
    const int64_t first = degree * degree, count = 2 * degree + 1;
    // Y(R d) c' = Y(d) c for all d.
    const Tensor turn = std::get<0>(torch::linalg_lstsq(y_to.narrow(1, first, count), y_from.narrow(1, first, count)));
    sh.narrow(1, first, count).copy_(torch::einsum("ab,nbc->nac", {turn, sh.narrow(1, first, count).clone()}));
  }
  const Tensor back = sh.to(torch::kFloat32).contiguous();
  std::copy_n(back.const_data_ptr<float>(), cloud.sh.size(), cloud.sh.begin());
}

// Turned about an axis, scaled, moved.
GaussianCloud Moved(const GaussianCloud& cloud, const std::array<double, 4>& q, double scale,
                    const std::array<double, 3>& shift) {
  GaussianCloud out = cloud;
  const auto r = RotationFromQuaternion(q[0], q[1], q[2], q[3]);
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const float* x = cloud.means.data() + 3 * i;
    for (size_t a = 0; a < 3; ++a) {
      out.means[static_cast<size_t>(3 * i) + a] =
          static_cast<float>(scale * (r[3 * a] * x[0] + r[3 * a + 1] * x[1] + r[3 * a + 2] * x[2]) + shift[a]);
      out.log_scales[static_cast<size_t>(3 * i) + a] += static_cast<float>(std::log(scale));
    }
    const float* p = cloud.quats.data() + 4 * i;
    float* t = out.quats.data() + 4 * i;
    t[0] = static_cast<float>(q[0] * p[0] - q[1] * p[1] - q[2] * p[2] - q[3] * p[3]);
    t[1] = static_cast<float>(q[0] * p[1] + q[1] * p[0] + q[2] * p[3] - q[3] * p[2]);
    t[2] = static_cast<float>(q[0] * p[2] - q[1] * p[3] + q[2] * p[0] + q[3] * p[1]);
    t[3] = static_cast<float>(q[0] * p[3] + q[1] * p[2] - q[2] * p[1] + q[3] * p[0]);
  }
  std::vector<double> values(r.begin(), r.end());
  TurnSphericalHarmonics(out, torch::tensor(values, torch::kFloat64).view({3, 3}));
  return out;
}

TEST(CompactModule, TurnsMovesAndScalesWithTheSplat) {
  const torch::NoGradGuard no_gradient;
  const GaussianCloud cloud = SheetCloud(120);
  const std::array<double, 4> q = {0.5, -0.1, 0.7, 0.5};
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const std::array<double, 4> unit = {q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm};
  const std::array<double, 3> shift = {0.3, -0.2, 0.9};
  for (CompactConfig config : Configs()) {
    // The axes of cube and curve are the world's.
    if (config.offset_unit == OffsetUnit::kCube || config.context == CompactContext::kPatches) continue;
    CompactTrainable network(config);
    ASSERT_TRUE(network.SetWeights(OpenDomain()).ok());
    const GaussianCloud expected = Moved(ToCloud(Copies(network, InputOf(cloud))), unit, 2.5, shift);
    const GaussianCloud moved = ToCloud(Copies(network, InputOf(Moved(cloud, unit, 2.5, shift), 2.5 * kSheetPixel)));
    ExpectNear(moved, expected, 1e-3);
  }
}

// Means, log-scales and so on of the copies of some of `n` Gaussians, all in one row each.
Tensor CopiesOf(const GaussianTensors& g, const std::vector<int64_t>& rows, int64_t n) {
  const Tensor all = torch::cat({g.means, g.log_scales, g.quats, g.opacity_logits.unsqueeze(1), g.sh.flatten(1)}, 1);
  return all.view({-1, n, all.size(1)}).index_select(1, torch::tensor(rows));
}

TEST(CompactModule, APartsCopiesAndGradientsAreThoseOfTheWhole) {
  const std::vector<int64_t> wanted = {411, 3, 4, 5, 6, 7, 8, 60, 599};
  std::vector<int64_t> every(wanted.size());
  std::iota(every.begin(), every.end(), int64_t{0});
  for (CompactConfig config : Configs()) {
    SCOPED_TRACE(config.copies);
    CompactTrainable network(config);
    ASSERT_TRUE(network.SetWeights(OpenDomain()).ok());
    const NetworkInput whole = InputOf(SheetCloud(600));
    const auto survey = network.Survey(whole);
    if (config.offset_unit == OffsetUnit::kCube) {
      EXPECT_FALSE(survey.ok()) << "a part does not know the cube";
      continue;
    }
    ASSERT_TRUE(survey.ok()) << survey.error().message;
    const auto part = std::make_shared<SplatPart>(network.PartOf(*survey, wanted));
    ASSERT_EQ(std::vector<int64_t>(part->rows.begin(), part->rows.begin() + part->wanted), wanted);
    EXPECT_LT(part->rows.size(), 600u);
    NetworkInput few;
    const auto rows = [&](const Tensor& t) { return t.index_select(0, torch::tensor(part->rows)); };
    const GaussianTensors& g = whole.gaussians;
    few.gaussians = {rows(g.means), rows(g.log_scales), rows(g.quats), rows(g.opacity_logits), rows(g.sh)};
    few.pixel_sizes = rows(whole.pixel_sizes);
    few.part = part;
    const Tensor expected = CopiesOf(Copies(network, whole), wanted, 600);
    const Tensor copies = CopiesOf(Copies(network, few), every, part->wanted);
    EXPECT_LT((copies - expected).abs().max().item<double>(), 1e-5);

    torch::manual_seed(2);
    const Tensor direction = torch::randn_like(expected);
    const auto gradients = [&](const Tensor& values) {
      return torch::autograd::grad({(values * direction).sum()}, network.parameters(), {}, std::nullopt, false, true);
    };
    const auto a = gradients(expected), b = gradients(copies);
    for (size_t i = 0; i < a.size(); ++i) {
      ASSERT_EQ(a[i].defined(), b[i].defined());
      if (!a[i].defined()) continue;
      EXPECT_LT((a[i] - b[i]).abs().max().item<double>(), 1e-4 * (1e-3 + a[i].abs().max().item<double>())) << i;
    }
  }
}

TEST(CompactModule, PartsLeaveTheRangeOfTheWholeBehind) {
  CompactTrainable whole({}), parts({});
  const NetworkInput input = InputOf(SheetCloud(400));
  Copies(whole, input);
  const auto survey = parts.Survey(input);
  ASSERT_TRUE(survey.ok());
  const std::vector<int64_t> wanted = {7};
  NetworkInput few;
  few.part = std::make_shared<SplatPart>(parts.PartOf(*survey, wanted));
  const auto cloud = Subset(SheetCloud(400), few.part->rows);
  ASSERT_TRUE(cloud.ok());
  few.gaussians = ToTensors(*cloud);
  few.pixel_sizes = torch::full({cloud->size()}, kSheetPixel);
  EXPECT_EQ(Copies(parts, few).size(), 4);
  for (const char* name : {"domain.low", "domain.high"}) {
    EXPECT_TRUE(torch::equal(whole.named_buffers()[name], parts.named_buffers()[name])) << name;
  }
}

TEST(CompactModule, GradientsMatchDifferences) {
  torch::manual_seed(5);
  CompactConfig config;
  config.copies = 2;
  config.hidden = 16;
  config.head_hidden = 16;
  config.rounds = 1;
  CompactTrainable network(config);
  ASSERT_TRUE(network.SetWeights(OpenDomain()).ok());
  network.eval();
  NetworkInput input = InputOf(SheetCloud(30));
  input.prepared = *network.Prepare(input);
  std::vector<Tensor> directions;
  const auto loss = [&] {
    const GaussianTensors g = network.Forward(input);
    Tensor sum = torch::zeros({}, torch::kFloat64);
    size_t next = 0;
    for (const Tensor& t : {g.means, g.log_scales, g.quats, g.opacity_logits, g.sh}) {
      if (directions.size() <= next) directions.push_back(torch::randn(t.sizes(), torch::kFloat64));
      sum = sum + (t.to(torch::kFloat64) * directions[next++]).sum();
    }
    return sum;
  };
  loss().backward();
  for (const auto& item : network.named_parameters()) {
    Tensor parameter = item.value();
    ASSERT_TRUE(parameter.grad().defined()) << item.key();
    // Along the gradient itself, where the difference is largest.
    const Tensor gradient = parameter.grad().clone();
    const double length = gradient.norm().item<double>();
    ASSERT_GT(length, 0) << item.key();
    const torch::NoGradGuard no_gradient;
    const Tensor step = gradient / length * 3e-3, kept = parameter.clone();
    parameter.add_(step);
    const double above = loss().item<double>();
    parameter.copy_(kept - step);
    const double below = loss().item<double>();
    parameter.copy_(kept);
    EXPECT_NEAR((above - below) / 6e-3, length, 0.02 * length + 1e-2) << item.key();
  }
}

TEST(CompactModule, SavesWhatInferenceOpens) {
  const TestFolder folder;
  const auto made = MakeCompactTrainable({{"copies", 2.0}, {"hidden", 32.0}, {"offset_unit", "pixel"}});
  ASSERT_TRUE(made.ok()) << made.error().message;
  auto& network = static_cast<CompactTrainable&>(**made);
  NetworkInput input = InputOf(SheetCloud(300));
  input.prepared = *network.Prepare(input);
  network.train();
  network.Forward(input);
  const auto file = folder / "network.safetensors";
  ASSERT_TRUE(network.Save(file, {{"licence", "CC0"}}).ok());
  const auto tensors = TensorFile::Open(file);
  ASSERT_TRUE(tensors.ok());
  EXPECT_TRUE(IsCompactNetwork(*tensors));
  EXPECT_EQ(tensors->metadata().at("licence"), "CC0");
  const auto opened = LoadCompactNetwork(*tensors);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  EXPECT_EQ(opened->config().copies, 2);
  EXPECT_EQ(opened->config().offset_unit, OffsetUnit::kPixel);
  const float pixel = kSheetPixel;
  const auto result = opened->Apply(SheetCloud(300), {.pixel_sizes = {&pixel, 1}, .upscale = 4, .strength = 0.7});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->unlike_training, 0) << "it was trained on this very splat";

  // Twice as many copies begin as these.
  auto more = MakeCompactTrainable({{"copies", 4.0}, {"hidden", 32.0}, {"init", file.string()}});
  ASSERT_TRUE(more.ok()) << more.error().message;
  EXPECT_TRUE(torch::equal((*more)->named_parameters()["embed.first.weight"],
                           network.named_parameters()["embed.first.weight"]));
  EXPECT_FALSE(MakeCompactTrainable({{"init", (folder / "none").string()}}).ok());
  EXPECT_FALSE(MakeCompactTrainable({{"hidden", 40.0}}).ok());
  EXPECT_FALSE(MakeCompactTrainable({{"wings", 2.0}}).ok());
}

TEST(CompactModule, RefusesWhatItCannotWorkWith) {
  CompactTrainable network({});
  GaussianCloud cloud = SheetCloud(10);
  EXPECT_FALSE(network.Prepare(InputOf(cloud, -1)).ok());
  cloud.means[4] = std::nanf("");
  EXPECT_FALSE(network.Prepare(InputOf(cloud)).ok());
  EXPECT_FALSE(network.Prepare(InputOf(SheetCloud(0))).ok());
}

TEST(CompactModule, GroupsHoldEveryParameterOnce) {
  CompactTrainable network({});
  size_t count = 0;
  std::vector<std::string> names;
  for (const auto& [name, parameters] : network.Groups()) {
    names.push_back(name);
    count += parameters.size();
  }
  EXPECT_EQ(count, network.parameters().size());
  EXPECT_THAT(names, testing::ElementsAre("backbone", "head", "strength", "means", "scales", "rotation", "opacity",
                                          "colour", "sh_gain", "sh_linear"));
}

}  // namespace
}  // namespace anchorsplat

#include "train/sample_loader.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/random.h"
#include "core/run.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "dataset/object_name.h"
#include "enhance/filter.h"
#include "train/augmentation.h"
#include "train/object_part.h"

namespace anchorsplat {

namespace {

constexpr size_t kAhead = 3;  // samples; a view of 1024² pixels is 12 MB

uint64_t Stream(uint64_t seed, const char* purpose, int64_t index) {
  return StableHash(Cat(purpose, " ", index), seed);
}

// The first `count` elements in random order.
template <typename Value>
void PartialShuffle(std::vector<Value>& values, size_t count, Random& random) {
  for (size_t i = 0; i < count; ++i) {
    std::swap(values[i], values[i + static_cast<size_t>(random.Below(static_cast<int64_t>(values.size() - i)))]);
  }
}

// Splat and views of a sample before augmentation.
struct Chosen {
  AugmentedScene scene;
  std::shared_ptr<const SplatPart> part;  // null: the whole splat
};

// Whole views or random crops, with the whole splat.
Result<Chosen> ChooseWhole(const TrainConfig& config, const SamplePlan& plan, const TrainingObject& object,
                           Random& random) {
  Chosen chosen;
  AugmentedScene& scene = chosen.scene;
  for (const size_t view : plan.views) {
    const Camera& camera = object.views[view];
    if (config.data.crop == 0) {
      scene.cameras.push_back(camera);
      ANCHORSPLAT_ASSIGN_OR_RETURN(scene.truth.emplace_back(), object.truth->Load(view));
      continue;
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelBox box, object.truth->Box(view));
    const PixelBox window =
        RandomWindow(camera.intrinsics.width, camera.intrinsics.height, box, config.data.crop, random);
    scene.cameras.push_back(Crop(camera, window));
    ANCHORSPLAT_ASSIGN_OR_RETURN(scene.truth.emplace_back(), object.truth->LoadWindow(view, window));
  }
  scene.cloud = object.cloud;
  scene.pixel_sizes = object.pixel_sizes;
  scene.strength = object.strength;
  return chosen;
}

// Windows around a spot, and the splat there: first the network's rows, then those drawn filtered. Both undergo the
// same augmentation.
Result<Chosen> ChoosePartOf(const TrainConfig& config, const SamplePlan& plan, TrainingObject& object,
                            TrainableNetwork& network, Random& random) {
  if (!object.survey) {
    auto survey = network.Survey(MakeInput(object, torch::kCPU));
    if (!survey.ok()) return Error{survey.error().code, Cat("data.part: ", survey.error().message)};
    object.survey = *std::move(survey);
  }
  if (!object.seen) {
    ANCHORSPLAT_RETURN_IF_ERROR(object.truth->Make(object.training));
    ANCHORSPLAT_ASSIGN_OR_RETURN(SeenGaussians seen,
                                 SeenGaussians::Look(object.cloud, object.low_views, object.training));
    object.seen = std::make_shared<const SeenGaussians>(std::move(seen));
  }
  const ObjectPart where = ChoosePart(
      object.cloud, object.views, plan.views, *object.seen,
      {.views = static_cast<size_t>(config.data.views_per_step), .side = config.data.crop, .most = config.data.part},
      random);
  Chosen chosen;
  AugmentedScene& scene = chosen.scene;
  for (size_t v = 0; v < where.views.size(); ++v) {
    scene.cameras.push_back(Crop(object.views[where.views[v]], where.windows[v]));
    ANCHORSPLAT_ASSIGN_OR_RETURN(scene.truth.emplace_back(),
                                 object.truth->LoadWindow(where.views[v], where.windows[v]));
  }
  const auto part = std::make_shared<const SplatPart>(network.PartOf(object.survey, where.wanted));
  const auto sizes_of = [&](const std::vector<int64_t>& rows) {
    Buffer<float> sizes;
    for (const int64_t row : rows) sizes.push_back(object.pixel_sizes[static_cast<size_t>(row)]);
    return sizes;
  };
  ANCHORSPLAT_ASSIGN_OR_RETURN(scene.cloud, Subset(object.cloud, part->rows));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud others, Subset(object.cloud, where.others));
  scene.pixel_sizes = sizes_of(part->rows);
  scene.strength = object.strength;
  const Buffer<float> sizes = sizes_of(where.others);
  if (!others.empty()) {
    const auto grown = ApplyFilter(others, sizes, {.upscale = object.upscale, .strength = object.strength});
    if (!grown.ok()) return grown.error();
  }
  ANCHORSPLAT_RETURN_IF_ERROR(Append(scene.cloud, others));
  scene.pixel_sizes.insert(scene.pixel_sizes.end(), sizes.begin(), sizes.end());
  chosen.part = part;
  return chosen;
}

GaussianTensors Rows(const GaussianTensors& g, int64_t begin, int64_t end) {
  const auto rows = [&](const torch::Tensor& t) { return t.narrow(0, begin, end - begin); };
  return {rows(g.means), rows(g.log_scales), rows(g.quats), rows(g.opacity_logits), rows(g.sh)};
}

}  // namespace

size_t PlannedObject(uint64_t seed, int64_t index, size_t objects) {
  const auto count = static_cast<int64_t>(objects);
  std::vector<size_t> order(objects);
  std::iota(order.begin(), order.end(), size_t{0});
  Random random(Stream(seed, "order", index / count));
  PartialShuffle(order, objects, random);
  return order[static_cast<size_t>(index % count)];
}

SamplePlan PlanSample(const TrainConfig& config, int64_t index, size_t objects, const TrainingObject& object) {
  SamplePlan plan;
  plan.object = PlannedObject(config.seed, index, objects);
  plan.seed = Stream(config.seed, "sample", index);
  plan.views = object.training;
  // For a part only the first view is fixed; the others are those that show the same spot.
  const size_t count = config.data.part > 0
                           ? plan.views.size()
                           : std::min(plan.views.size(), static_cast<size_t>(config.data.views_per_step));
  if (!config.data.fixed_views) {
    Random random(Stream(config.seed, "views", index));
    PartialShuffle(plan.views, count, random);
  }
  plan.views.resize(count);
  return plan;
}

namespace {

NetworkInput MakeInputOf(const TrainingObject& object, const GaussianCloud& cloud, const Buffer<float>& pixel_sizes,
                         double strength, torch::Device device) {
  NetworkInput input;
  input.gaussians = ToTensors(cloud).To(device);
  torch::Tensor sizes = torch::empty({cloud.size()}, torch::kFloat32);
  std::copy(pixel_sizes.begin(), pixel_sizes.end(), sizes.mutable_data_ptr<float>());
  input.pixel_sizes = sizes.to(device);
  input.upscale = object.upscale;
  input.strength = strength;
  input.mode = object.cloud.render_mode;
  return input;
}

}  // namespace

NetworkInput MakeInput(const TrainingObject& object, torch::Device device) {
  return MakeInputOf(object, object.cloud, object.pixel_sizes, object.strength, device);
}

NetworkInput MakeInput(const TrainingObject& object, const AugmentedScene& scene, torch::Device device) {
  return MakeInputOf(object, scene.cloud, scene.pixel_sizes, scene.strength, device);
}

Result<TrainingSample> MakeSample(const TrainConfig& config, int64_t index, ObjectStore& objects,
                                  TrainableNetwork& network, torch::Device device) {
  Stopwatch watch;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto object, objects.Get(PlannedObject(config.seed, index, objects.size())));
  const SamplePlan plan = PlanSample(config, index, objects.size(), *object);
  Random random(plan.seed);
  auto made = config.data.part > 0 ? ChoosePartOf(config, plan, *object, network, random)
                                   : ChooseWhole(config, plan, *object, random);
  if (!made.ok()) return Error{made.error().code, Cat(object->name, ": ", made.error().message)};
  AugmentedScene& scene = made->scene;
  Augment(config.augmentation, random, scene);

  TrainingSample sample;
  sample.object = object->name;
  sample.render.mode = object->cloud.render_mode.value_or(RenderMode::kClassic);
  sample.render.background = scene.truth.empty() ? object->background : scene.truth[0].background;
  sample.input = MakeInput(*object, scene, device);
  if (made->part) {
    const auto seen = static_cast<int64_t>(made->part->rows.size());
    sample.others = Rows(sample.input.gaussians, seen, scene.cloud.size()).To(torch::kCPU);
    sample.input.gaussians = Rows(sample.input.gaussians, 0, seen);
    sample.input.pixel_sizes = sample.input.pixel_sizes.narrow(0, 0, seen);
    sample.input.part = made->part;
  }
  // Unaugmented tables can be reused, unless p_LR or f, on which they may depend, vary.
  const AugmentationConfig& changes = config.augmentation;
  const bool reusable = !made->part && !changes.geometry() && changes.pixel_size_noise == 0 &&
                        changes.strength_noise == 0 && !changes.permute_colors && changes.gain == 0;
  if (reusable && object->prepared) {
    sample.input.prepared = object->prepared;
  } else {
    auto prepared = network.Prepare(sample.input);
    if (!prepared.ok()) {
      return Error{prepared.error().code, Cat(object->name, ": ", prepared.error().message)};
    }
    sample.input.prepared = *std::move(prepared);
    if (reusable) object->prepared = sample.input.prepared;
  }
  if (config.loss.lpips > 0) {
    for (TrueView& truth : scene.truth) {
      const int width = truth.picture.width, height = truth.picture.height;
      truth.perceptual = config.loss.lpips_crop == 0
                             ? PixelBox{0, 0, width, height}
                             : RandomWindow(width, height, truth.object, config.loss.lpips_crop, random);
    }
  }
  sample.cameras = std::move(scene.cameras);
  sample.truth = std::move(scene.truth);
  sample.seconds = watch.Lap();
  return sample;
}

SampleLoader::SampleLoader(const TrainConfig& config, Order order, ObjectStore& objects, TrainableNetwork& network,
                           torch::Device device)
    : config_(config),
      order_(order),
      objects_(objects),
      network_(network),
      device_(device),
      thread_([this, run = internal::CurrentRun()] {
        const internal::JoinRun part(run);  // joins the training's run
        Run();
      }) {}

SampleLoader::~SampleLoader() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void SampleLoader::Run() {
  const torch::NoGradGuard no_gradient;
  at::set_num_threads(1);  // for this thread; the others are busy
  for (int64_t index = order_.first;; ++index) {
    const int64_t place = index % order_.group;
    if (place < order_.offset || place >= order_.offset + order_.count) continue;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait(lock, [&] { return stop_ || ready_.size() < kAhead; });
      if (stop_) return;
    }
    const auto make = [&]() -> Result<TrainingSample> {
      try {
        return MakeSample(config_, index, objects_, network_, device_);
      } catch (const std::exception& failure) {  // from LibTorch, or out of memory
        return Error{ErrorCode::kIo, failure.what()};
      }
    };
    Result<TrainingSample> sample = make();
    const bool failed = !sample.ok();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ready_.push_back(std::move(sample));
    }
    changed_.notify_all();
    if (failed) return;
  }
}

Result<TrainingSample> SampleLoader::Next() {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [&] { return !ready_.empty(); });
  Result<TrainingSample> sample = std::move(ready_.front());
  // An error stays in the queue, so further calls return it again.
  if (sample.ok()) {
    ready_.pop_front();
  } else {
    ready_.front() = Result<TrainingSample>(sample.error());
  }
  lock.unlock();
  changed_.notify_all();
  return sample;
}

}  // namespace anchorsplat

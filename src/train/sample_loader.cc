#include "train/sample_loader.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/random.h"
#include "core/text.h"
#include "dataset/object_name.h"
#include "fit/stopwatch.h"
#include "train/augmentation.h"

namespace anchorsplat {

namespace {

constexpr size_t kAhead = 3;  // samples; a view of 1024² pixels is 12 MB

uint64_t Stream(uint64_t seed, const char* purpose, int64_t index) {
  return StableHash(Cat(purpose, " ", index), seed);
}

// The first `count` places of a random order.
template <typename Value>
void PartialShuffle(std::vector<Value>& values, size_t count, Random& random) {
  for (size_t i = 0; i < count; ++i) {
    std::swap(values[i], values[i + static_cast<size_t>(random.Below(static_cast<int64_t>(values.size() - i)))]);
  }
}

// A window of at most `side` pixels a side inside of a picture, around a random pixel of the object.
PixelBox RandomWindow(int width, int height, const PixelBox& object, int side, Random& random) {
  const int w = std::min(side, width), h = std::min(side, height);
  const PixelBox where = object.empty() ? PixelBox{0, 0, width, height} : object;
  const auto place = [&](int begin, int end, int extent, int limit) {
    const int center = begin + static_cast<int>(random.Below(end - begin));
    return std::clamp(center - extent / 2, 0, limit - extent);
  };
  const int x = place(where.x0, where.x1, w, width), y = place(where.y0, where.y1, h, height);
  return {x, y, x + w, y + h};
}

void CropView(const PixelBox& window, Camera& camera, TrueView& view) {
  camera = Crop(camera, window);
  Image part(window.x1 - window.x0, window.y1 - window.y0, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < part.height; ++y) {
      const float* row = view.picture.channel(c) + int64_t{y + window.y0} * view.picture.width;
      std::copy(row + window.x0, row + window.x1, part.channel(c) + int64_t{y} * part.width);
    }
  }
  PixelBox& o = view.object;
  o = {std::max(0, o.x0 - window.x0), std::max(0, o.y0 - window.y0), std::min(part.width, o.x1 - window.x0),
       std::min(part.height, o.y1 - window.y0)};
  if (o.empty()) o = {};
  view.picture = std::move(part);
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
  const size_t count = std::min(plan.views.size(), static_cast<size_t>(config.data.views_per_step));
  if (!config.data.fixed_views) {
    Random random(Stream(config.seed, "views", index));
    PartialShuffle(plan.views, count, random);
  }
  plan.views.resize(count);
  return plan;
}

NetworkInput MakeInput(const GaussianCloud& cloud, const Buffer<float>& pixel_sizes, double upscale,
                       torch::Device device) {
  NetworkInput input;
  input.gaussians = ToTensors(cloud).To(device);
  torch::Tensor sizes = torch::empty({cloud.size()}, torch::kFloat32);
  std::copy(pixel_sizes.begin(), pixel_sizes.end(), sizes.mutable_data_ptr<float>());
  input.pixel_sizes = sizes.to(device);
  input.upscale = upscale;
  return input;
}

Result<TrainingSample> MakeSample(const TrainConfig& config, int64_t index, ObjectStore& objects,
                                  TrainableNetwork& network, torch::Device device) {
  Stopwatch watch;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto object, objects.Get(PlannedObject(config.seed, index, objects.size())));
  const SamplePlan plan = PlanSample(config, index, objects.size(), *object);
  AugmentedScene scene;
  for (const size_t view : plan.views) {
    scene.cameras.push_back(object->views[view]);
    ANCHORSPLAT_ASSIGN_OR_RETURN(TrueView truth, object->truth->Load(view));
    scene.truth.push_back(std::move(truth));
  }
  scene.cloud = object->cloud;
  scene.pixel_sizes = object->pixel_sizes;
  Random random(plan.seed);
  Augment(config.augmentation, random, scene);

  TrainingSample sample;
  sample.object = object->name;
  sample.render.mode = object->cloud.render_mode.value_or(RenderMode::kClassic);
  sample.render.background = scene.truth.empty() ? object->background : scene.truth[0].background;
  sample.input = MakeInput(scene.cloud, scene.pixel_sizes, object->upscale, device);
  // Tables of the splat as it is serve every step, unless p_LR, which they may depend on, moves.
  const bool reusable = !config.augmentation.geometry() && config.augmentation.pixel_size_noise == 0 &&
                        !config.augmentation.permute_colors && config.augmentation.gain == 0;
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
  for (size_t v = 0; v < scene.cameras.size(); ++v) {
    Camera& camera = scene.cameras[v];
    TrueView& truth = scene.truth[v];
    if (config.data.crop > 0) {
      CropView(RandomWindow(camera.intrinsics.width, camera.intrinsics.height, truth.object, config.data.crop, random),
               camera, truth);
    }
    if (config.loss.lpips > 0) {
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
    : config_(config), order_(order), objects_(objects), network_(network), device_(device), thread_([this] {
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
  at::set_num_threads(1);  // of this thread: the others have better things to do
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
      } catch (const std::exception& failure) {  // LibTorch's and memory's
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
  // An error stays in place: whoever asks again hears it again.
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

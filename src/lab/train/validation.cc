#include "train/validation.h"

#include <functional>
#include <numeric>

#include "core/text.h"
#include "enhance/filter.h"
#include "metrics/image_metrics.h"
#include "train/sample_loader.h"

namespace anchorsplat {

// An object with its tables, kept between validations; true pictures are read again.
struct Validation::Object {
  std::shared_ptr<TrainingObject> data;
  std::vector<size_t> views;
  NetworkInput input;
};

namespace {

std::vector<SceneEntry> Chosen(std::vector<SceneEntry> entries, int most) {
  std::vector<size_t> all(entries.size());
  std::iota(all.begin(), all.end(), size_t{0});
  std::vector<SceneEntry> chosen;
  for (const size_t i : EvenlySpread(all, static_cast<size_t>(most))) chosen.push_back(entries[i]);
  return chosen;
}

Image ToImage(const torch::Tensor& picture) {
  Image image(static_cast<int>(picture.size(2)), static_cast<int>(picture.size(1)), 3);
  std::copy_n(picture.const_data_ptr<float>(), picture.numel(), image.pixels.data());
  return image;
}

TrainQuality Mean(const std::vector<TrainQuality>& parts) {
  TrainQuality mean;
  const auto count = static_cast<double>(parts.size());
  double lpips = 0;
  bool all = !parts.empty();
  for (const TrainQuality& part : parts) {
    mean.psnr += part.psnr / count;
    mean.ssim += part.ssim / count;
    lpips += part.lpips.value_or(0) / count;
    all = all && part.lpips.has_value();
  }
  if (all) mean.lpips = lpips;
  return mean;
}

}  // namespace

Validation::Validation(const ValidationConfig& config, std::vector<SceneEntry> entries, std::filesystem::path cache,
                       std::shared_ptr<const PerceptualObjective> perceptual, torch::Device device)
    : config_(config),
      entries_(Chosen(std::move(entries), config.objects)),
      cache_(std::move(cache)),
      perceptual_(std::move(perceptual)),
      device_(device),
      open_(entries_.size()) {}

Result<Validation::Object*> Validation::Open(size_t index) {
  if (!open_[index]) {
    auto object = std::make_shared<Object>();
    ANCHORSPLAT_ASSIGN_OR_RETURN(object->data, OpenTrainingObject(entries_[index], 1, cache_));
    object->views = EvenlySpread(object->data->validation, static_cast<size_t>(config_.views));
    object->input = MakeInput(*object->data, device_);
    open_[index] = std::move(object);
  }
  return open_[index].get();
}

Result<std::vector<TrainQuality>> Validation::MeasureClouds(
    const std::function<Result<GaussianTensors>(Object&)>& cloud_of) {
  const torch::NoGradGuard no_gradient;
  std::vector<TrainQuality> objects;
  for (size_t index = 0; index < entries_.size(); ++index) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(Object * object, Open(index));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianTensors cloud, cloud_of(*object));
    RenderOptions options;
    options.mode = object->data->cloud.render_mode.value_or(RenderMode::kClassic);
    options.background = object->data->background;
    std::vector<Camera> cameras;
    for (const size_t view : object->views) cameras.push_back(object->data->views[view]);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<RenderedView> rendered, render_(cloud, cameras, options));
    std::vector<TrainQuality> views;
    for (size_t v = 0; v < rendered.size(); ++v) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const TrueView truth, object->data->truth->Load(object->views[v]));
      Image image = ToImage(rendered[v].color);
      Clamp01(image);
      TrainQuality quality;
      ANCHORSPLAT_ASSIGN_OR_RETURN(quality.psnr, Psnr(image, truth.picture));
      ANCHORSPLAT_ASSIGN_OR_RETURN(quality.ssim, Ssim(image, truth.picture));
      if (perceptual_) quality.lpips = perceptual_->Distance(image, truth.picture);
      views.push_back(quality);
    }
    objects.push_back(Mean(views));
  }
  return objects;
}

Result<TrainQuality> Validation::Measure(TrainableNetwork& network) {
  const bool training = network.is_training();
  network.eval();
  auto objects = MeasureClouds([&](Object& object) -> Result<GaussianTensors> {
    if (!object.input.prepared) {
      auto prepared = network.Prepare(object.input);
      if (!prepared.ok()) {
        return Error{prepared.error().code, Cat(object.data->name, ": ", prepared.error().message)};
      }
      object.input.prepared = *std::move(prepared);
    }
    return network.Forward(object.input);
  });
  network.train(training);
  if (!objects.ok()) return objects.error();
  return Mean(*objects);
}

Result<TrainQuality> Validation::Raw() {
  if (!raw_) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto objects, MeasureClouds([](Object& object) -> Result<GaussianTensors> {
                                   return ToTensors(object.data->cloud);
                                 }));
    raw_ = Mean(objects);
  }
  return *raw_;
}

Result<TrainQuality> Validation::Filter() {
  if (!filter_) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto objects, MeasureClouds([](Object& object) -> Result<GaussianTensors> {
                                   GaussianCloud cloud = object.data->cloud;
                                   const auto grown = ApplyFilter(
                                       cloud, object.data->pixel_sizes,
                                       {.upscale = object.data->upscale, .strength = object.data->strength});
                                   if (!grown.ok()) return grown.error();
                                   return ToTensors(cloud);
                                 }));
    filter_ = Mean(objects);
  }
  return *filter_;
}

}  // namespace anchorsplat

#include "train/trainer.h"

#include <torch/torch.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/file_system.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "dataset/object_name.h"
#include "io/file_bytes.h"
#include "io/input_record.h"
#include "model/torch/make_trainable_network.h"
#include "published/torch/point_batch_norm.h"
#include "train/autocast.h"
#include "train/merged_copies.h"
#include "train/optimizer.h"
#include "train/perceptual_objective.h"
#include "train/photometric_objective.h"
#include "train/process_group.h"
#include "train/sample_loader.h"
#include "train/train_checkpoint.h"
#include "train/train_log.h"
#include "train/training_data.h"
#include "train/validation.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr int kMostBadSteps = 50;  // in succession
constexpr double kFirstLossScale = 65536;
constexpr int64_t kLossScaleGrowth = 2000;  // good steps before the loss scale doubles

GaussianTensors InFloat(const GaussianTensors& g) {
  const auto host = [](const torch::Tensor& t) { return t.to(torch::kCPU, torch::kFloat32); };
  return {host(g.means), host(g.log_scales), host(g.quats), host(g.opacity_logits), host(g.sh)};
}

GaussianTensors Together(const GaussianTensors& a, const GaussianTensors& b) {
  if (!b.means.defined() || b.size() == 0) return a;
  const auto both = [](const torch::Tensor& x, const torch::Tensor& y) { return torch::cat({x, y}); };
  return {both(a.means, b.means), both(a.log_scales, b.log_scales), both(a.quats, b.quats),
          both(a.opacity_logits, b.opacity_logits), both(a.sh, b.sh)};
}

// Seconds per part of a step and loss terms, summed between two log lines.
struct Sums {
  int64_t steps = 0, views = 0;
  double data = 0, network = 0, render = 0, loss_time = 0, backward = 0, optimizer = 0;
  double loss = 0, l1 = 0, ssim = 0, mse = 0, lpips = 0, psnr = 0, norm = 0;
};

class Trainer {
 public:
  Trainer(const TrainRequest& request, TrainConfig config) : request_(request), config_(std::move(config)) {}

  Status Begin();
  Status Run();
  TrainReport report() const { return report_; }

 private:
  Status Step(SampleLoader& loader);
  Status Look(SampleLoader& loader);
  GaussianTensors Merged(const GaussianTensors& all, const NetworkInput& input) const;
  Status Update();
  Status WriteLogLine();
  Status Validate();
  Status SaveNetwork(const char* name);
  Status WriteAll();
  bool Due(int64_t every) const { return every > 0 && progress_.step % every == 0; }
  double Elapsed() const { return progress_.seconds + clock_seconds_; }
  bool Over() const;
  double PartDone() const;
  bool Leads() const { return !group_ || group_->rank() == 0; }
  bool Asked() const { return StopRequested(); }
  // With several processes only what all agreed on counts; else one would wait for another that has ended.
  bool Stopping() const { return group_ ? agreed_stop_ : Asked(); }
  void Agree();

  const TrainRequest& request_;
  TrainConfig config_;
  std::string config_text_;
  torch::Device device_ = torch::kCPU;
  std::unique_ptr<ProcessGroup> group_;  // null: single process
  TrainingData data_;
  std::unique_ptr<ObjectStore> objects_;
  std::shared_ptr<TrainableNetwork> network_;
  std::optional<Optimizer> optimizer_;
  std::optional<PerceptualObjective> perceptual_;
  std::optional<Validation> validation_;
  std::optional<TrainLog> log_;
  RenderOp render_;
  TrainProgress progress_;
  TrainReport report_;
  Stopwatch clock_;
  double clock_seconds_ = 0;  // of this run
  Sums sums_;
  int bad_steps_ = 0;
  // Agreed by all processes: elapsed time, and whether one was asked to stop.
  double agreed_elapsed_ = 0;
  bool agreed_stop_ = false;
  double last_norm_ = 0, last_factor_ = 0, last_loss_ = 0, last_psnr_ = 0;
};

Status CheckFolder(const TrainRequest& request) {
  std::error_code code;
  fs::create_directories(request.out, code);
  if (!IsFolder(request.out)) {
    return Error{ErrorCode::kIo, Cat(request.out.string(), ": cannot be made a folder: ", code.message())};
  }
  const fs::path checkpoint = request.out / "checkpoint.safetensors";
  if (Exists(checkpoint) && !request.resume && !request.overwrite) {
    return Error{ErrorCode::kExists, Cat(checkpoint.string(), " exists; --resume continues it, -w starts over")};
  }
  return {};
}

Status Trainer::Begin() {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckFolder(request_));
  if (config_.device == "cuda" && !torch::cuda::is_available()) {
    return Error{ErrorCode::kBadArgument, Cat(config_.file, ": device: this LibTorch sees no CUDA device")};
  }
  if (config_.device == "cuda" || (config_.device == "auto" && torch::cuda::is_available())) device_ = torch::kCUDA;
  ANCHORSPLAT_ASSIGN_OR_RETURN(group_, ProcessGroup::FromEnvironment());
  at::set_num_threads(ThreadCount());
  // Deterministic gather sums, but without deterministic mode's filling of fresh memory.
  at::globalContext().setDeterministicAlgorithms(true, /*warn_only=*/true);
  at::globalContext().setDeterministicFillUninitializedMemory(false);

  const fs::path cache = request_.cache.empty() ? request_.out / "cache" : request_.cache;
  ANCHORSPLAT_ASSIGN_OR_RETURN(data_, FindTrainingData(request_, config_.captures, cache));
  if (config_.data.least_upscale > 0) {
    ANCHORSPLAT_RETURN_IF_ERROR(
        DrawUpscales(config_.data.least_upscale, config_.data.greatest_upscale, data_.training));
  }
  objects_ = std::make_unique<ObjectStore>(data_.training, data_.captures, config_.data.views_per_object, cache,
                                           static_cast<size_t>(config_.data.objects_in_memory));
  if (config_.loss.lpips > 0) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(perceptual_, PerceptualObjective::Open(config_.loss.lpips_net));
  }
  if (!data_.validation.empty() && Leads()) {
    std::shared_ptr<const PerceptualObjective> measure;
    if (config_.validation.lpips) {
      auto opened = PerceptualObjective::Open(LpipsNet::kAlex);
      if (opened.ok()) {
        measure = std::make_shared<PerceptualObjective>(*std::move(opened));
      } else {
        LogWarning(opened.error().message);
      }
    }
    validation_.emplace(config_.validation, data_.validation, cache, measure, device_);
  }

  torch::manual_seed(config_.seed);
  auto network = MakeTrainableNetwork(config_.kind, config_.network);
  if (!network.ok()) return InNetworkTable(config_, network.error());
  network_ = *std::move(network);
  network_->to(device_);
  if (group_) {
    network_->apply([this](torch::nn::Module& module) {
      if (auto* norm = module.as<PointBatchNormImpl>()) {
        norm->SynchroniseOver([this](torch::Tensor& tensor) { group_->Sum(tensor); });
      }
    });
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(optimizer_, Optimizer::Make(*network_, config_));
  progress_.settings = Settings(config_).dump();
  progress_.objects = data_.names;
  progress_.loss_scale = config_.precision == Precision::kFp16 ? kFirstLossScale : 1;
  const fs::path checkpoint = request_.out / "checkpoint.safetensors";
  if (request_.resume && Exists(checkpoint)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(progress_, ReadTrainCheckpoint(checkpoint, progress_, *optimizer_));
  } else if (!request_.start.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(StartFromCheckpoint(request_.start, *optimizer_));
    ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(checkpoint));  // must not be the start checkpoint
  }
  if (Leads()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(log_, TrainLog::Open(request_.out, progress_.step));
  }
  agreed_elapsed_ = progress_.seconds;

  report_.resumed_at = progress_.step;
  report_.objects = static_cast<int64_t>(objects_->size());
  report_.validation_objects = validation_ ? static_cast<int64_t>(validation_->objects()) : 0;
  report_.parameters = optimizer_->parameters();
  report_.file = request_.out / "model.safetensors";
  if (!Leads()) return {};
  LogInfo(Cat(WithThousands(report_.parameters), " parameters, ", report_.objects, " objects, ",
              report_.validation_objects, " for validation", group_ ? Cat(", ", group_->size(), " processes") : "",
              progress_.step > 0 ? Cat(", resuming after step ", WithThousands(progress_.step)) : ""));
  return {};
}

bool Trainer::Over() const {
  return progress_.step >= config_.steps || (request_.minutes && agreed_elapsed_ >= 60 * *request_.minutes);
}

double Trainer::PartDone() const {
  const double steps = static_cast<double>(progress_.step) / static_cast<double>(config_.steps);
  return request_.minutes ? std::max(steps, agreed_elapsed_ / (60 * *request_.minutes)) : steps;
}

// Merges copies as `enhance` does, at a cost drawn for the step.
GaussianTensors Trainer::Merged(const GaussianTensors& all, const NetworkInput& input) const {
  const double least = std::log(config_.data.least_merge_cost), most = std::log(config_.data.greatest_merge_cost);
  const double drawn = torch::rand({1}, torch::kFloat64).item<double>();
  const int64_t copies = network_->copies();
  return MergedCopies(all, {.copies = copies,
                            .pixel_sizes = input.pixel_sizes.narrow(0, 0, all.size() / copies) / input.upscale,
                            .mode = input.mode.value_or(RenderMode::kClassic),
                            .cost = std::exp(least + drawn * (most - least))});
}

// Computes one sample's gradient.
Status Trainer::Look(SampleLoader& loader) {
  Stopwatch watch;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TrainingSample sample, loader.Next());
  sums_.data += watch.Lap();
  GaussianTensors gaussians;
  {
    const Autocast autocast(config_.precision, device_);
    gaussians = network_->Forward(sample.input);
  }
  gaussians = InFloat(gaussians);
  if (config_.data.greatest_merge_cost > 0) gaussians = Merged(gaussians, sample.input);
  gaussians = Together(gaussians, sample.others);
  sums_.network += watch.Lap();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<RenderedView> views,
                               render_(gaussians, sample.cameras, sample.render));
  sums_.render += watch.Lap();
  std::vector<torch::Tensor> pictures;
  for (const RenderedView& view : views) pictures.push_back(view.color);
  const PhotometricLossSum photometric = PhotometricObjective(pictures, sample.truth, config_.loss);
  torch::Tensor loss = photometric.loss;
  if (perceptual_) {
    const torch::Tensor distance = (*perceptual_)(pictures, sample.truth);
    sums_.lpips += distance.item<double>() / config_.data.scenes_per_step;
    loss = loss + config_.loss.lpips * distance;
  }
  last_loss_ += loss.item<double>() / config_.data.scenes_per_step;
  for (const PhotometricTerms& terms : photometric.terms) {
    if (terms.foreground == 0) continue;
    ++sums_.views;
    sums_.l1 += terms.l1;
    sums_.ssim += terms.ssim;
    sums_.mse += terms.mse;
    sums_.psnr += std::min(terms.psnr, 100.0);
    last_psnr_ = terms.psnr;
  }
  sums_.loss_time += watch.Lap();
  if (std::isfinite(last_loss_)) (loss * (progress_.loss_scale / config_.data.scenes_per_step)).backward();
  sums_.backward += watch.Lap();
  return {};
}

// Sums gradients, losses, clocks and stop requests over all processes at once.
void Trainer::Agree() {
  if (!group_) {
    agreed_elapsed_ = Elapsed();
    return;
  }
  const torch::NoGradGuard no_gradient;
  const std::vector<torch::Tensor> gradients = optimizer_->Gradients();
  std::vector<torch::Tensor> flat;
  for (const torch::Tensor& gradient : gradients) flat.push_back(gradient.to(torch::kCPU).flatten());
  flat.push_back(torch::tensor({last_loss_, Elapsed(), Asked() ? 1.0 : 0.0}).to(torch::kFloat32));
  torch::Tensor sum = torch::cat(flat);
  group_->Sum(sum);
  sum.div_(group_->size());
  int64_t at = 0;
  for (const torch::Tensor& gradient : gradients) {
    gradient.copy_(sum.narrow(0, at, gradient.numel()).view(gradient.sizes()));
    at += gradient.numel();
  }
  last_loss_ = sum[at].item<double>();
  agreed_elapsed_ = sum[at + 1].item<double>();
  agreed_stop_ = sum[at + 2].item<double>() > 0;
  network_->ShareMemory([this](torch::Tensor& tensor) { group_->Max(tensor); });
}

// Applies the gradient if it is finite.
Status Trainer::Update() {
  Agree();
  last_norm_ = optimizer_->GradientNorm() / progress_.loss_scale;
  if (!std::isfinite(last_loss_) || !std::isfinite(last_norm_)) {
    ++progress_.skipped;
    progress_.since_scaled = 0;
    if (config_.precision == Precision::kFp16) progress_.loss_scale = std::max(1.0, progress_.loss_scale / 2);
    if (++bad_steps_ >= kMostBadSteps) {
      return Error{ErrorCode::kBadArgument,
                   Cat("the gradient was not a number in ", kMostBadSteps, " steps on end (now at step ",
                       progress_.step, "): a smaller optimizer.learning_rate or optimizer.clip may help")};
    }
    return {};
  }
  bad_steps_ = 0;
  const double clip = config_.optimizer.clip;
  const double factor = (clip > 0 && last_norm_ > clip ? clip / last_norm_ : 1) / progress_.loss_scale;
  if (factor != 1) optimizer_->ScaleGradients(factor);
  last_factor_ = RateFactor(config_.optimizer, progress_.step, PartDone());
  optimizer_->Step(last_factor_);
  progress_.optimizer_steps = optimizer_->steps();
  if (config_.precision == Precision::kFp16 && ++progress_.since_scaled >= kLossScaleGrowth) {
    progress_.loss_scale *= 2;
    progress_.since_scaled = 0;
  }
  return {};
}

Status Trainer::Step(SampleLoader& loader) {
  // For DropPath and the like: a separate random stream per step.
  torch::manual_seed(StableHash(Cat("step ", progress_.step), config_.seed));
  network_->train();
  optimizer_->ZeroGradients();
  last_loss_ = 0;
  for (int s = 0; s < config_.data.scenes_per_step; ++s) ANCHORSPLAT_RETURN_IF_ERROR(Look(loader));
  Stopwatch watch;
  ANCHORSPLAT_RETURN_IF_ERROR(Update());
  sums_.optimizer += watch.Lap();
  ++progress_.step;
  ++sums_.steps;
  sums_.loss += last_loss_;
  sums_.norm += last_norm_;
  return {};
}

nlohmann::json ToJson(const TrainQuality& quality) {
  nlohmann::json json = {{"psnr", quality.psnr}, {"ssim", quality.ssim}};
  if (quality.lpips) json["lpips"] = *quality.lpips;
  return json;
}

Status Trainer::WriteLogLine() {
  if (!Leads()) {
    sums_ = {};
    return {};
  }
  const auto steps = static_cast<double>(std::max<int64_t>(1, sums_.steps));
  const auto views = static_cast<double>(std::max<int64_t>(1, sums_.views));
  nlohmann::json line = {{"step", progress_.step},
                         {"loss", sums_.loss / steps},
                         {"l1", sums_.l1 / views},
                         {"psnr", sums_.psnr / views},
                         {"learning_rate", config_.optimizer.learning_rate * last_factor_},
                         {"gradient_norm", sums_.norm / steps},
                         {"skipped", progress_.skipped}};
  if (config_.loss.ssim > 0) line["ssim"] = sums_.ssim / views;
  if (config_.loss.mse > 0) line["mse"] = sums_.mse / views;
  if (perceptual_) line["lpips"] = sums_.lpips / steps;
  if (config_.precision == Precision::kFp16) line["loss_scale"] = progress_.loss_scale;
  line["seconds"] = {{"all", Elapsed()},
                     {"data", sums_.data / steps},
                     {"network", sums_.network / steps},
                     {"render", sums_.render / steps},
                     {"loss", sums_.loss_time / steps},
                     {"backward", sums_.backward / steps},
                     {"render_backward", render_.backward_seconds() / steps},
                     {"optimizer", sums_.optimizer / steps}};
  report_.loss = sums_.loss / steps;
  sums_ = {};
  render_.ResetBackwardSeconds();
  return log_->Add(line);
}

Status Trainer::SaveNetwork(const char* name) {
  std::map<std::string, std::string> metadata = {{"program", Cat("anchorsplat ", ANCHORSPLAT_VERSION)},
                                                 {"kind", config_.kind},
                                                 {"recipe", config_text_},
                                                 {"seed", Cat(config_.seed)},
                                                 {"steps", Cat(progress_.step)},
                                                 {"objects", Cat(report_.objects)},
                                                 {"object_names", data_.names}};
  if (request_.minutes) metadata["minutes"] = Cat(*request_.minutes);  // may end training before the recipe's steps
  if (report_.model) {
    const nlohmann::json quality = {
        {"model", ToJson(*report_.model)}, {"raw", ToJson(*report_.raw)}, {"filter", ToJson(*report_.filter)}};
    metadata["validation"] = quality.dump();
  }
  optimizer_->SwapAverage();
  Status saved = network_->Save(request_.out / name, metadata);
  optimizer_->SwapAverage();
  return saved;
}

Status Trainer::Validate() {
  if (!validation_) return {};  // no validation data, or not the leading process
  Stopwatch watch;
  ANCHORSPLAT_ASSIGN_OR_RETURN(report_.raw, validation_->Raw());
  ANCHORSPLAT_ASSIGN_OR_RETURN(report_.filter, validation_->Filter());
  optimizer_->SwapAverage();
  auto quality = validation_->Measure(*network_);
  optimizer_->SwapAverage();
  if (!quality.ok()) return quality.error();
  report_.model = *quality;
  LogInfo(Cat("step ", WithThousands(progress_.step), ": validation ", Fixed(quality->psnr, 3), " dB (raw ",
              Fixed(report_.raw->psnr, 3), ", filter ", Fixed(report_.filter->psnr, 3), ")"));
  ANCHORSPLAT_RETURN_IF_ERROR(log_->Add({{"step", progress_.step},
                                         {"validation",
                                          {{"model", ToJson(*report_.model)},
                                           {"raw", ToJson(*report_.raw)},
                                           {"filter", ToJson(*report_.filter)},
                                           {"objects", validation_->objects()},
                                           {"seconds", watch.Lap()}}}}));
  if (quality->psnr > progress_.best_psnr) {
    progress_.best_psnr = quality->psnr;
    ANCHORSPLAT_RETURN_IF_ERROR(SaveNetwork("best.safetensors"));
  }
  return log_->WriteCurve();
}

Status Trainer::WriteAll() {
  if (!Leads()) return {};
  TrainProgress progress = progress_;
  progress.seconds = Elapsed();
  ANCHORSPLAT_RETURN_IF_ERROR(WriteTrainCheckpoint(request_.out / "checkpoint.safetensors", *optimizer_, progress));
  ANCHORSPLAT_RETURN_IF_ERROR(SaveNetwork("model.safetensors"));
  return log_->WriteCurve();
}

Status Trainer::Run() {
  auto text = ReadFileBytes(request_.config, uint64_t{1} << 20);
  if (text.ok()) config_text_ = *text;
  if (progress_.step == 0) ANCHORSPLAT_RETURN_IF_ERROR(Validate());
  const int64_t scenes = config_.data.scenes_per_step;
  const int64_t together = scenes * (group_ ? group_->size() : 1);
  if (!Over()) {
    SampleLoader loader(config_,
                        {.first = progress_.step * together,
                         .group = together,
                         .offset = scenes * (group_ ? group_->rank() : 0),
                         .count = scenes},
                        *objects_, *network_, device_);
    Progress bar("training", config_.steps);
    bar.Advance(progress_.step);
    clock_.Lap();
    while (!Over() && !Stopping()) {
      const Status stepped = Step(loader);
      clock_seconds_ += clock_.Lap();
      if (!stepped.ok()) return stepped;
      bar.Advance(1, Cat("loss ", Fixed(last_loss_, 4), ", ", Fixed(last_psnr_, 1), " dB"));
      if (Due(config_.log_every)) ANCHORSPLAT_RETURN_IF_ERROR(WriteLogLine());
      if (Due(config_.validation.every) && !Over()) ANCHORSPLAT_RETURN_IF_ERROR(Validate());
      if (Due(config_.checkpoint_every) && !Over()) ANCHORSPLAT_RETURN_IF_ERROR(WriteAll());
      clock_.Lap();  // excludes validation from the minutes
    }
  }
  if (sums_.steps > 0) report_.loss = sums_.loss / static_cast<double>(sums_.steps);
  report_.interrupted = Stopping() && !Over();
  if (!report_.interrupted) ANCHORSPLAT_RETURN_IF_ERROR(Validate());
  report_.steps = progress_.step;
  report_.skipped = progress_.skipped;
  report_.seconds = clock_seconds_;
  return WriteAll();
}

}  // namespace

Result<TrainReport> Train(const TrainRequest& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(TrainConfig config, ReadTrainConfig(request.config));
  if (request.steps) config.steps = *request.steps;
  if (request.seed) config.seed = *request.seed;
  try {
    Trainer trainer(request, std::move(config));
    ANCHORSPLAT_RETURN_IF_ERROR(trainer.Begin());
    ANCHORSPLAT_RETURN_IF_ERROR(trainer.Run());
    return trainer.report();
  } catch (const c10::Error& failure) {
    return Error{ErrorCode::kIo, Cat("LibTorch failed: ", failure.what_without_backtrace())};
  }
}

}  // namespace anchorsplat

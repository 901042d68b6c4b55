#include "api/bridge.h"

#include <algorithm>
#include <memory>

#include "core/log.h"
#include "core/text.h"
#include "gpu/open_gpu.h"

namespace anchorsplat {

namespace {

class CallbackSink : public LogSink {
 public:
  explicit CallbackSink(const RunSettings& run) : message_(run.message), progress_(run.progress) {}

  void Message(LogLevel level, const std::string& text) override {
    if (message_) message_(level == LogLevel::kInfo ? MessageLevel::kInfo : MessageLevel::kWarning, text);
  }
  void TaskBegin(const std::string& name, int64_t total) override {
    task_ = {.task = name, .done = 0, .total = total, .note = {}, .ended = false};
    if (progress_) progress_(task_);
  }
  void TaskProgress(int64_t done, const std::string& note) override {
    task_.done = done;
    task_.note = note;
    if (progress_) progress_(task_);
  }
  void TaskEnd() override {
    task_.ended = true;
    if (progress_) progress_(task_);
  }

 private:
  decltype(RunSettings::message) message_;
  decltype(RunSettings::progress) progress_;
  anchorsplat::TaskProgress task_;
};

}  // namespace

Splat SplatAccess::Make(GaussianCloud cloud) {
  return Splat(std::make_unique<Splat::Owned>(Splat::Owned{std::move(cloud)}));
}

GaussianCloud SplatAccess::Take(Splat splat) { return splat.owned_ ? std::move(splat.owned_->cloud) : GaussianCloud(); }

Failure ToFailure(const Error& error) {
  constexpr FailureKind kKinds[] = {FailureKind::kBadArgument, FailureKind::kNotFound, FailureKind::kBadFile,
                                    FailureKind::kExists,      FailureKind::kIo,       FailureKind::kStopped};
  static_assert(static_cast<int>(ErrorCode::kInterrupted) == static_cast<int>(FailureKind::kStopped));
  return {kKinds[static_cast<int>(error.code)], error.message};
}

CloudView ToCloud(const SplatView& view) {
  CloudView cloud;
  cloud.sh_degree = view.sh_degree;
  cloud.means = view.means;
  cloud.log_scales = view.log_scales;
  cloud.quats = view.quats;
  cloud.opacity_logits = view.opacity_logits;
  cloud.sh = view.sh;
  cloud.render_mode = ToMode(view.rasterization);
  cloud.comments = view.comments;
  cloud.origin = view.origin;
  return cloud;
}

SplatView ToView(const CloudView& cloud) {
  return {.sh_degree = cloud.sh_degree,
          .means = cloud.means,
          .log_scales = cloud.log_scales,
          .quats = cloud.quats,
          .opacity_logits = cloud.opacity_logits,
          .sh = cloud.sh,
          .rasterization = ToRasterization(cloud.render_mode),
          .comments = cloud.comments,
          .origin = cloud.origin};
}

std::optional<RenderMode> ToMode(std::optional<Rasterization> rasterization) {
  if (!rasterization) return std::nullopt;
  switch (*rasterization) {
    case Rasterization::kAntialiased:
      return RenderMode::kAntialiased;
    case Rasterization::kMip:
      return RenderMode::kMip;
    default:
      return RenderMode::kClassic;
  }
}

std::optional<Rasterization> ToRasterization(std::optional<RenderMode> mode) {
  if (!mode) return std::nullopt;
  switch (*mode) {
    case RenderMode::kAntialiased:
      return Rasterization::kAntialiased;
    case RenderMode::kMip:
      return Rasterization::kMip;
    default:
      return Rasterization::kClassic;
  }
}

Camera ToCamera(const PinholeCamera& camera) {
  return {.name = camera.name,
          .image = {},
          .intrinsics = {camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy},
          .world_to_camera = {camera.rotation, camera.translation},
          .photograph = {}};
}

PinholeCamera ToPinhole(const Camera& camera) {
  const Pinhole& k = camera.intrinsics;
  return {.name = camera.name,
          .width = k.width,
          .height = k.height,
          .fx = k.fx,
          .fy = k.fy,
          .cx = k.cx,
          .cy = k.cy,
          .rotation = camera.world_to_camera.rotation,
          .translation = camera.world_to_camera.translation};
}

Result<Image> ToImage(const Picture& picture) {
  const auto& [width, height, channels, pixels] = picture;
  const bool sane = width >= 0 && height >= 0 && channels >= 0 && channels <= 4 && width <= kMaxImageSide &&
                    height <= kMaxImageSide && int64_t{width} * height <= kMaxImagePixels;
  if (!sane || static_cast<int64_t>(pixels.size()) != int64_t{width} * height * channels) {
    return Error{ErrorCode::kBadArgument, Cat("a picture of ", width, " x ", height, " pixels with ", channels,
                                              " channels has ", pixels.size(), " values")};
  }
  Image image(width, height, channels);
  std::ranges::copy(pixels, image.pixels.begin());
  return image;
}

Picture ToPicture(const Image& image) {
  return {image.width, image.height, image.channels, {image.pixels.begin(), image.pixels.end()}};
}

Result<RunContext> ToContext(const RunSettings& run) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const DeviceChoice device, ParseDeviceChoice(run.device));
  return RunContext{.threads = run.threads,
                    .sink = std::make_shared<CallbackSink>(run),
                    .stop = run.stop,
                    .abandon = run.abandon,
                    .device = device,
                    .max_gpu_memory = run.max_gpu_memory};
}

Status OpenDevice() {
  const auto gpu = GpuOfRun();
  return gpu.ok() ? Status() : gpu.error();
}

const char* LibraryVersion() { return ANCHORSPLAT_VERSION; }

}  // namespace anchorsplat

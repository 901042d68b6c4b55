// gpu_recording FOLDER: what a GPU is told and answers for a few pictures with their gradients and a short fit, for
// scripts/gpu_browser_test.mjs.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "bench/gpu_bench_scene.h"
#include "bench/recording/recorder.h"
#include "core/run_context.h"
#include "fit/fit.h"
#include "fit/orbit_scene_for_test.h"
#include "gpu/gpu_for_test.h"
#include "io/folder_for_test.h"
#include "render/rasterizer.h"

namespace anchorsplat {

namespace {

constexpr DeviceChoice kGpu{DeviceChoice::Kind::kGpu};

Status DrawAll() {
  GaussianCloud cloud = GpuBenchCloud(400, 1);
  for (size_t a = 28; a < 32; ++a) cloud.quats[a] *= 1e-13f;  // one that is left to the CPU, and patched in
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Camera camera, GpuBenchCamera(72, 50));
  for (const RenderMode mode : kRenderModes) {
    RenderOptions options;
    options.mode = mode;
    options.profile = mode == RenderMode::kClassic ? RasterProfile::kGsplat14 : RasterProfile::kGsplat15;
    options.background = {0.2f, 0.4f, 0.6f};
    options.gradient = options.depth = true;
    options.absgrad = mode == RenderMode::kClassic;
    RenderGradient weights = GpuBenchWeights(72, 50, 2);
    weights.box = {0, 0, 72, 50};
    Rasterizer rasterizer;
    RenderOutput output;
    CloudGradient gradient;
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, camera, options, output));
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Backward(cloud, weights, gradient));
  }
  return {};
}

Status FitALittle() {
  const TestFolder folder;
  {
    const RunScope cpu({.device = DeviceChoice{}});
    orbit_scene::Write(folder.path(), orbit_scene::Ball(100, 5), 4, 48);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TrainingViews views, OpenProject(folder.path(), {.hold_out = 0}));
  FitOptions options;
  options.steps = 8;
  options.densification.refine_start_iter = 2;
  options.densification.refine_every = 3;
  options.densification.refine_stop_iter = 8;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Fitted fitted, Fit(views, orbit_scene::Ball(120, 6), options));
  return fitted.report.interrupted ? Status(Error{ErrorCode::kInterrupted, "stopped"}) : Status();
}

Status Record(const std::filesystem::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::shared_ptr<GpuDevice> device, OpenGpu(kGpu));
  const auto recorder = std::make_shared<Recorder>(std::move(device));
  const RunScope run({.device = kGpu});
  const ScopedGpuForTest scope(recorder);
  ANCHORSPLAT_RETURN_IF_ERROR(DrawAll());
  ANCHORSPLAT_RETURN_IF_ERROR(FitALittle());
  if (const std::string why = WhyGpuWasGivenUp(); !why.empty()) return Error{ErrorCode::kIo, why};
  return recorder->WriteTo(folder);
}

}  // namespace

}  // namespace anchorsplat

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: gpu_recording FOLDER\n"), 2;
  const anchorsplat::Status status = anchorsplat::Record(argv[1]);
  if (status.ok()) return 0;
  std::fprintf(stderr, "gpu_recording: %s\n", status.error().message.c_str());
  return 1;
}

#include <algorithm>
#include <new>
#include <vector>

#include "core/run_context.h"
#include "render/rasterizer_state.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kBytesTogether = uint64_t{48} << 20;  // of pictures per wait
constexpr uint64_t kPartTogether = 16;                   // denominator: their maximum share of the run's GPU memory
constexpr uint64_t kPartForPairs = 8;                    // denominator: for the pairs of one picture
constexpr int64_t kPairBytes = 16;
constexpr int64_t kFewPairs = 1 << 16;  // always fits

}  // namespace

// Pairs to allocate per picture: twice the maximum so far. 0: too many.
int64_t Rasterizer::State::PairsTogether(const ConstantCloud& cloud, const RenderOptions& options) const {
  const int64_t most = cloud.most_pairs().value_or(0);
  const auto room = static_cast<int64_t>(std::min(MaxGpuMemoryOfRun() / kPartForPairs / kPairBytes,
                                                  gpu->device->adapter().max_binding / sizeof(uint32_t)));
  const int64_t wanted =
      std::min({std::max(2 * most, kFewPairs), std::max(room, gpu->pair_capacity), options.max_pairs});
  return wanted >= most ? wanted : 0;
}

size_t Rasterizer::State::CountTogether(ConstantCloud& cloud, std::span<const Camera> cameras,
                                        const RenderOptions& options) {
  // The first picture gives the number of pairs.
  if (cameras.size() < 2 || !cloud.most_pairs() || OpenGpu() == nullptr) return 0;
  if (PairsTogether(cloud, options) == 0) return 0;
  if (const Result<GpuCloud*> there = Upload({cloud.view(), &cloud}); !there.ok() || !(*there)->resident()) return 0;
  const uint64_t room =
      std::min({kBytesTogether, MaxGpuMemoryOfRun() / kPartTogether, gpu->device->adapter().max_binding});
  size_t count = 0;
  for (uint64_t bytes = 0; count < cameras.size(); ++count) {
    if (!ValidateRender(cameras[count], options).ok()) break;
    bytes += GpuRasterizer::BytesTogether(cameras[count].intrinsics, options);
    if (bytes > room) break;
  }
  return count < 2 ? 0 : count;
}

Status Rasterizer::RenderEach(ConstantCloud& cloud, std::span<const Camera> cameras, const RenderOptions& options,
                              const std::function<Status(size_t, RenderOutput&)>& use) {
  state_->kept.reset();
  // Other pictures need the memory.
  struct AtEnd {
    State& state;
    ~AtEnd() {
      if (state.gpu != nullptr) state.gpu->ForgetTogether();
    }
  } const at_end{*state_};
  RenderOutput output;
  std::vector<RenderOutput> outputs;
  std::vector<Camera> from_origin;
  std::vector<GpuRasterizer::Picture> pictures;
  bool together = !options.gradient && Validate(cloud.view()).ok();
  for (size_t next = 0; next < cameras.size();) {
    const size_t count = together ? state_->CountTogether(cloud, cameras.subspan(next), options) : 0;
    if (count == 0) {
      ANCHORSPLAT_RETURN_IF_ERROR(Render(cloud, cameras[next], options, output));
      ANCHORSPLAT_RETURN_IF_ERROR(use(next++, output));
      continue;
    }
    Stopwatch watch;
    pictures.clear();
    from_origin.assign(cameras.begin() + static_cast<std::ptrdiff_t>(next),
                       cameras.begin() + static_cast<std::ptrdiff_t>(next + count));
    try {
      outputs.resize(std::max(outputs.size(), count));
      for (size_t k = 0; k < count; ++k) {
        Camera& camera = from_origin[k];
        const float near = NearPlane(options, camera);
        camera.world_to_camera = RelativeToOrigin(camera.world_to_camera, cloud.view().origin);
        ShapeFor(camera, options, outputs[k]);
        pictures.push_back({.camera = camera, .near = near, .output = outputs[k]});
      }
    } catch (const std::bad_alloc&) {
      outputs.clear();
      together = false;
      continue;
    }
    const Result<GpuCloud*> there = cloud.On(state_->gpu->device);
    const Status drawn =
        there.ok() ? state_->gpu->DrawTogether(**there, pictures, options, state_->PairsTogether(cloud, options))
                   : Status(there.error());
    if (!drawn.ok()) {  // they may fit one by one
      together = false;
      continue;
    }
    const double each = watch.Lap() / static_cast<double>(count);
    for (size_t k = 0; k < count; ++k) {
      if (pictures[k].drawn) {
        state_->statistics = {};
        state_->statistics.blend = each;
        state_->statistics.visible = pictures[k].visible;
        state_->statistics.pairs = pictures[k].total_pairs;
        state_->statistics.runs = 1;
      } else {
        ANCHORSPLAT_RETURN_IF_ERROR(Render(cloud, cameras[next + k], options, outputs[k]));
      }
      ANCHORSPLAT_RETURN_IF_ERROR(use(next + k, outputs[k]));
    }
    next += count;
  }
  return {};
}

}  // namespace anchorsplat

#include <algorithm>
#include <array>
#include <new>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"
#include "gpu/open_gpu.h"
#include "render/blend_backward.h"
#include "render/gradient_slots.h"
#include "render/project.h"
#include "render/project_backward.h"
#include "render/rasterizer_state.h"
#include "render/spherical_harmonics_backward.h"

namespace anchorsplat {

namespace {

Error BadGradientArgument(std::string message) { return {ErrorCode::kBadArgument, std::move(message)}; }

Error NoPicture() {
  return BadGradientArgument("no picture to take the gradient of: render one with RenderOptions::gradient first");
}

Error NoMemory(int64_t count) {
  return {ErrorCode::kIo, Cat("not enough memory for the gradient of ", WithThousands(count), " Gaussians")};
}

// Slot parameters of a picture with `count` Gaussians.
Status CheckCloud(const CloudView& cloud, int64_t count, int sh_degree) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  if (cloud.size() == count && cloud.sh_degree == sh_degree) return {};
  return BadGradientArgument(Cat("the picture is of ", WithThousands(count), " Gaussians of SH degree ", sh_degree,
                                 ", not of ", WithThousands(cloud.size()), " of degree ", cloud.sh_degree));
}

Status CheckGradient(const RenderGradient& g, int width, int height) {
  const auto fits = [&](const Image& image, int channels) {
    return image.width == width && image.height == height && image.channels == channels &&
           image.pixels.size() == static_cast<size_t>(channels) * static_cast<size_t>(image.plane());
  };
  if (!fits(g.color, 3)) {
    return BadGradientArgument(Cat("gradient of ", g.color.width, " x ", g.color.height, " x ", g.color.channels,
                                   " for a picture of ", width, " x ", height, " x 3"));
  }
  if (!g.alpha.pixels.empty() && !fits(g.alpha, 1)) {
    return BadGradientArgument(Cat("alpha gradient of ", g.alpha.width, " x ", g.alpha.height, " x ", g.alpha.channels,
                                   " for a picture of ", width, " x ", height, " x 1"));
  }
  const PixelBox& b = g.box;
  if (!b.empty() && (b.x0 < 0 || b.y0 < 0 || b.x1 > width || b.y1 > height)) {
    return BadGradientArgument(Cat("box [", b.x0, ", ", b.x1, ") x [", b.y0, ", ", b.y1,
                                   ") reaches outside of a picture of ", width, " x ", height));
  }
  return {};
}

// Maximum slots (render/gradient_slots.h) at once, 150 MiB. With more, tiles are processed in several runs.
constexpr int64_t kMaxSlots = int64_t{1} << 22;

}  // namespace

std::optional<Rasterizer::State::SlotsLeft> Rasterizer::State::BlendBackward(const RenderGradient& output_gradient,
                                                                             CloudGradient& gradient) {
  const RenderOptions& options = kept->options;
  const BinParams bin = MakeBinParams(statistics.visible, kept->intrinsics, options.min_alpha);
  const int64_t tile_count = int64_t{bin.tiles_x} * bin.tiles_y, chunks = ProjectChunks(kept->count);
  // The list of the last run of tiles still exists; with one run it covers all.
  const bool listed = statistics.runs == 1;
  if (!listed) CountPairs(bin);
  int64_t* starts = Room(slot_starts, chunks);
  std::exclusive_scan(slot_counts.data(), slot_counts.data() + chunks, starts, int64_t{0});
  int64_t slot_count = std::accumulate(slot_counts.data(), slot_counts.data() + chunks, int64_t{0});
  // A single thread adds directly to the gradients; multiple threads need slots, if possible all at once.
  const bool apart = ThreadCount() > 1, at_once = apart && listed && slot_count <= kMaxSlots;

  SlotsLeft left{};
  left.params = {.count = kept->count,
                 .tiles = tiles.data(),
                 .visible = visible.data(),
                 .visible_counts = visible_counts.data(),
                 .tiles_x = bin.tiles_x,
                 .tiles_y = bin.tiles_y,
                 .first_tile = 0,
                 .last_tile = tile_count,
                 .projected = projected.data()};
  BlendGradient* own = Room(gradients, kept->count);
  BlendBackwardParams p{};
  p.width = kept->intrinsics.width;
  p.height = kept->intrinsics.height;
  p.tiles_x = bin.tiles_x;
  p.projected = projected.data();
  p.tile_offsets = bin.tile_offsets;
  std::copy(options.background.begin(), options.background.end(), p.background);
  p.min_alpha = options.min_alpha;
  p.transmittance = transmittance.data();
  p.contributors = contributors.data();
  p.box = output_gradient.box;
  p.color_gradient = output_gradient.color.pixels.data();
  p.alpha_gradient = output_gradient.alpha.pixels.empty() ? nullptr : output_gradient.alpha.pixels.data();
  p.tile_backgrounds = Room(tile_backgrounds, 3 * tile_count);
  p.slot_starts = starts;
  double background_gradient[3] = {0, 0, 0};
  p.background_gradient = background_gradient;
  gradient.means2d_abs.assign(options.absgrad ? 2 * static_cast<size_t>(kept->count) : 0, 0.0f);
  float* absolute = options.absgrad ? gradient.means2d_abs.data() : nullptr;
  if (!apart) {
    std::fill_n(own, kept->count, BlendGradient{});
    p.gradients = own;
    p.absolute = absolute;
  }
  for (int64_t listed_to = 0; listed_to < tile_count;) {
    const int64_t listed_from = listed_to;
    listed_to = listed ? tile_count : EndOfRun(bin, listed_from, options.max_pairs);
    const auto pairs_before = [&](int64_t tile) { return bin.tile_offsets[tile] - bin.tile_offsets[listed_from]; };
    if (!listed) ListPairs(bin, listed_from, listed_to, Room(pairs, pairs_before(listed_to) + bin.chunks));
    for (p.first_tile = listed_from; p.first_tile < listed_to; p.first_tile = p.last_tile) {
      p.pairs = pairs.data() + pairs_before(p.first_tile);
      p.last_tile = listed_to;
      if (!apart) {
        BlendBackwardCpu(p);
        continue;
      }
      if (!at_once) {
        left.params.first_tile = p.first_tile;
        left.params.last_tile = std::min(listed_to, EndOfRun(bin, p.first_tile, kMaxSlots));  // every pair needs a slot
        slot_count = PlaceSlots(left.params, kMaxSlots, starts);
      }
      p.last_tile = left.params.last_tile;
      p.sums = Room(slot_sums, slot_count);
      p.absolute = options.absgrad ? Room(slot_absolute, 2 * slot_count) : nullptr;
      p.touched = Room(slot_touched, slot_count);
      left.slots = {starts, p.sums, p.absolute, p.touched};
      ParallelFor(0, slot_count, int64_t{1} << 18,
                  [&](int64_t first, int64_t last) { std::fill(p.touched + first, p.touched + last, uint8_t{0}); });
      BlendBackwardCpu(p);
      if (at_once) continue;
      ParallelFor(0, chunks, 1, [&](int64_t chunk, int64_t) {
        SumSlots(left.params, left.slots, chunk, p.first_tile == 0, own, absolute);
      });
    }
  }
  for (size_t c = 0; c < 3; ++c) gradient.background[c] = static_cast<float>(background_gradient[c]);
  return at_once ? std::optional(left) : std::nullopt;
}

void Rasterizer::State::ProjectBackward(const std::optional<SlotsLeft>& left, const CloudView& cloud,
                                        const CoefficientStep* step, CloudGradient& gradient) {
  const size_t n = static_cast<size_t>(kept->count);
  gradient.means.resize(3 * n);
  gradient.log_scales.resize(3 * n);
  gradient.quats.resize(4 * n);
  gradient.opacity_logits.resize(n);
  gradient.sh.resize(step == nullptr ? cloud.sh.size() : 0);
  gradient.means2d.resize(2 * n);
  gradient.radii.resize(2 * n);

  ProjectBackwardParams project{};
  project.count = kept->count;
  project.means = cloud.means.data();
  project.log_scales = cloud.log_scales.data();
  project.quats = cloud.quats.data();
  project.opacity_logits = cloud.opacity_logits.data();
  project.intrinsics = kept->intrinsics;
  project.world_to_camera = kept->world_to_camera;
  project.mode = kept->options.mode;
  project.dilation = DilationOf(kept->options);
  project.compensated_from = kept->options.compensated_from;
  project.projected = projected.data();
  project.gradients = gradients.data();
  project.visible = visible.data();
  project.visible_counts = visible_counts.data();
  project.mean_gradients = gradient.means.data();
  project.log_scale_gradients = gradient.log_scales.data();
  project.quat_gradients = gradient.quats.data();
  project.opacity_logit_gradients = gradient.opacity_logits.data();
  project.means2d = gradient.means2d.data();

  SphericalHarmonicsBackwardParams sh{};
  sh.count = kept->count;
  sh.degree = std::min(kept->options.sh_degree, cloud.sh_degree);
  sh.stride = cloud.sh_stride();
  sh.means = cloud.means.data();
  sh.sh = cloud.sh.data();
  sh.center = kept->center;
  sh.projected = projected.data();
  sh.gradients = gradients.data();
  sh.visible = visible.data();
  sh.visible_counts = visible_counts.data();
  sh.mean_gradients = gradient.means.data();
  sh.sh_gradients = step == nullptr ? gradient.sh.data() : nullptr;
  sh.step = step;

  float* absolute = kept->options.absgrad ? gradient.means2d_abs.data() : nullptr;
  // All stages of a chunk while it is in the cache.
  ParallelFor(0, ProjectChunks(kept->count), 1, [&](int64_t first, int64_t last) {
    for (int64_t chunk = first; chunk < last; ++chunk) {
      if (left) {
        SumSlots(left->params, left->slots, chunk, true, gradients.data(), absolute);
      }
      ProjectBackwardCpu(project, chunk);
      SphericalHarmonicsBackwardCpu(sh, chunk);
      const int64_t begin = 2 * chunk * kProjectChunk, end = std::min(begin + 2 * kProjectChunk, 2 * kept->count);
      std::copy(radii.data() + begin, radii.data() + end, gradient.radii.data() + begin);
    }
  });
}

void Rasterizer::State::DrawAgainOnCpu(const Source& source) {
  DropGpu();
  if (source.constant != nullptr) source.constant->Release();
  Camera camera;
  camera.intrinsics = kept->intrinsics;
  camera.world_to_camera = kept->world_to_camera;
  RenderOptions options = kept->options;
  options.depth = false;
  RenderOutput again;
  again.color = Image(camera.intrinsics.width, camera.intrinsics.height, 3);
  again.alpha = Image(camera.intrinsics.width, camera.intrinsics.height, 1);
  DrawOnCpu(source.cloud, camera, kept->near, options, again);
  kept->on_gpu = false;
}

Status Rasterizer::State::BackwardOnGpu(const Source& source, const RenderGradient& output_gradient,
                                        const CoefficientStep* step, CloudGradient& gradient) {
  const CloudView& cloud = source.cloud;
  Stopwatch watch;
  const RenderOptions& options = kept->options;
  GpuDevice& device = *gpu->device;
  if (gpu_backward == nullptr) gpu_backward = std::make_unique<GpuRasterizerBackward>(*gpu);
  ANCHORSPLAT_RETURN_IF_ERROR(gpu_backward->Blend(options, output_gradient));
  ANCHORSPLAT_RETURN_IF_ERROR(gpu_backward->ReadBackground(gradient.background));
  statistics.blend_backward = watch.Lap();

  // Streamed, dropped or host-side data is read from this call's cloud.
  GpuCloud* drawn = &gpu_cloud;
  if (source.constant != nullptr || gpu_cloud.empty() || !gpu_cloud.resident() || !gpu->unusual_rows.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(drawn, Upload(source));
  }
  const auto n = static_cast<size_t>(kept->count);
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  gradient.means.resize(3 * n);
  gradient.log_scales.resize(3 * n);
  gradient.quats.resize(4 * n);
  gradient.opacity_logits.resize(n);
  gradient.sh.resize(step == nullptr ? stride * n : 0);
  gradient.means2d.resize(2 * n);
  gradient.means2d_abs.resize(options.absgrad ? 2 * n : 0);
  gradient.radii.resize(2 * n);
  // The step comes last, when nothing can fail and need a retry.
  float* sh = step == nullptr ? gradient.sh.data() : Room(sh_gradients, static_cast<int64_t>(stride * n));
  ANCHORSPLAT_RETURN_IF_ERROR(gpu_backward->Project(*drawn, options, [&](const GpuGradient& part) -> Status {
    std::vector<GpuRead> reads;
    const auto read = [&](const GpuMemory& memory, float* column, size_t width) {
      const auto first = static_cast<size_t>(part.first), count = static_cast<size_t>(part.count);
      reads.push_back({memory.get(), 0, std::as_writable_bytes(std::span(column + first * width, count * width))});
    };
    read(part.means, gradient.means.data(), 3);
    read(part.log_scales, gradient.log_scales.data(), 3);
    read(part.quats, gradient.quats.data(), 4);
    read(part.opacity_logits, gradient.opacity_logits.data(), 1);
    read(part.sh, sh, stride);
    read(part.means2d, gradient.means2d.data(), 2);
    if (options.absgrad) read(part.means2d_abs, gradient.means2d_abs.data(), 2);
    return device.Read(reads);
  }));
  if (n > 0) {
    const GpuRead read = {gpu->radii.get(), 0, std::as_writable_bytes(std::span(gradient.radii))};
    ANCHORSPLAT_RETURN_IF_ERROR(device.Read({&read, 1}));
  }
  if (step != nullptr) StepCoefficients(*step, cloud.sh_stride(), kept->count, sh);
  statistics.project_backward = watch.Lap();
  return {};
}

Status Rasterizer::State::BackwardToAppearanceOnGpu(const RenderGradient& output_gradient) {
  constexpr int64_t kRowsRead = int64_t{1} << 18;
  Stopwatch watch;
  GpuDevice& device = *gpu->device;
  if (gpu_backward == nullptr) gpu_backward = std::make_unique<GpuRasterizerBackward>(*gpu);
  ANCHORSPLAT_RETURN_IF_ERROR(gpu_backward->Blend(kept->options, output_gradient));
  const int64_t n = kept->count;
  ProjectedGaussian* to_projected = Room(projected, n);
  BlendGradient* to_sums = Room(gradients, n);
  int32_t* to_radii = Room(radii, 2 * n);
  std::vector<GpuSeen> seen(static_cast<size_t>(std::min(n, kRowsRead)));
  std::vector<std::array<float, 12>> sums(seen.size());
  for (int64_t first = 0; first < n; first += kRowsRead) {
    const auto begin = static_cast<size_t>(first), count = static_cast<size_t>(std::min(kRowsRead, n - first));
    const std::array<GpuRead, 3> reads = {
        {{gpu->seen.get(), sizeof(GpuSeen) * begin, std::as_writable_bytes(std::span(seen.data(), count))},
         {&gpu_backward->sums(), sizeof(sums[0]) * begin, std::as_writable_bytes(std::span(sums.data(), count))},
         {gpu->radii.get(), 8 * begin, std::as_writable_bytes(std::span(to_radii + 2 * first, 2 * count))}}};
    ANCHORSPLAT_RETURN_IF_ERROR(device.Read(reads));
    for (size_t k = 0; k < count; ++k) {
      to_projected[begin + k] = FromGpu(seen[k]);
      to_sums[begin + k] = FromGpu(sums[k]);
    }
  }
  statistics.blend_backward = watch.Lap();
  return {};
}

void Rasterizer::State::BackwardToAppearanceOnCpu(const RenderGradient& output_gradient) {
  Stopwatch watch;
  CloudGradient unused;
  // Slots are summed only for visible Gaussians; the others are 0.
  BlendGradient* sums = Room(gradients, kept->count);
  ParallelFor(0, kept->count, int64_t{1} << 16,
              [&](int64_t first, int64_t last) { std::fill(sums + first, sums + last, BlendGradient{}); });
  if (const std::optional<SlotsLeft> left = BlendBackward(output_gradient, unused)) {
    float* absolute = kept->options.absgrad ? unused.means2d_abs.data() : nullptr;
    ParallelFor(0, ProjectChunks(kept->count), 1, [&](int64_t chunk, int64_t) {
      SumSlots(left->params, left->slots, chunk, /*first_run=*/true, sums, absolute);
    });
  }
  statistics.blend_backward = watch.Lap();
}

Status Rasterizer::Backward(const CloudView& cloud, const RenderGradient& output_gradient, CloudGradient& gradient,
                            const CoefficientStep* step) {
  return BackwardOfSource({cloud}, output_gradient, gradient, step);
}

Status Rasterizer::Backward(ConstantCloud& cloud, const RenderGradient& output_gradient, CloudGradient& gradient) {
  return BackwardOfSource({cloud.view(), &cloud}, output_gradient, gradient, nullptr);
}

Status Rasterizer::BackwardOfSource(const Source& source, const RenderGradient& output_gradient,
                                    CloudGradient& gradient, const CoefficientStep* step) {
  const CloudView& cloud = source.cloud;
  if (!state_->kept) return NoPicture();
  const State::Kept& kept = *state_->kept;
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCloud(cloud, kept.count, kept.sh_degree));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckGradient(output_gradient, kept.intrinsics.width, kept.intrinsics.height));
  if (step != nullptr && (step->values != cloud.sh.data() || step->columns > cloud.sh_stride() ||
                          step->columns < 3 * ShCoefficients(std::min(kept.options.sh_degree, cloud.sh_degree)))) {
    return BadGradientArgument(Cat("a step of ", step->columns, " coefficients that is not of the picture's cloud"));
  }
  try {
    if (kept.on_gpu) {
      const Status status = state_->BackwardOnGpu(source, output_gradient, step, gradient);
      if (status.ok()) return {};
      GiveUpGpu(status.error());
      state_->DrawAgainOnCpu(source);
    }
    Stopwatch watch;
    const std::optional<State::SlotsLeft> left = state_->BlendBackward(output_gradient, gradient);
    state_->statistics.blend_backward = watch.Lap();
    state_->ProjectBackward(left, cloud, step, gradient);
    state_->statistics.project_backward = watch.Lap();
  } catch (const std::bad_alloc&) {
    return NoMemory(cloud.size());
  }
  return {};
}

Result<AppearanceGradient> Rasterizer::BackwardToAppearance(const CloudView& cloud,
                                                            const RenderGradient& output_gradient) {
  if (!state_->kept) return NoPicture();
  const State::Kept& kept = *state_->kept;
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCloud(cloud, kept.count, kept.sh_degree));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckGradient(output_gradient, kept.intrinsics.width, kept.intrinsics.height));
  try {
    if (kept.on_gpu) {
      const Status status = state_->BackwardToAppearanceOnGpu(output_gradient);
      if (!status.ok()) {
        GiveUpGpu(status.error());
        state_->DrawAgainOnCpu({cloud});
      }
    }
    if (!kept.on_gpu) state_->BackwardToAppearanceOnCpu(output_gradient);
  } catch (const std::bad_alloc&) {
    return NoMemory(kept.count);
  }
  const auto n = static_cast<size_t>(kept.count);
  return AppearanceGradient{std::span(state_->gradients.data(), n), std::span(state_->projected.data(), n),
                            std::span(state_->radii.data(), 2 * n)};
}

}  // namespace anchorsplat

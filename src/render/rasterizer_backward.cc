#include <algorithm>
#include <new>

#include "core/parallel.h"
#include "core/text.h"
#include "render/blend_backward.h"
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

// Pairs whose gradients are kept apart at once: 36 MiB. More pairs are done in several runs of tiles.
constexpr int64_t kMaxPartial = int64_t{1} << 20;

}  // namespace

void Rasterizer::State::BlendBackward(const RenderGradient& output_gradient, CloudGradient& gradient) {
  const RenderOptions& options = kept->options;
  const BinParams bin = MakeBinParams(statistics.visible, kept->intrinsics, options.min_alpha);
  const int64_t tile_count = int64_t{bin.tiles_x} * bin.tiles_y;
  // The list of the last run of tiles is still there: with one run that is all of them.
  const bool listed = statistics.runs == 1;
  if (!listed) CountPairs(bin);

  BlendBackwardParams p{};
  p.width = kept->intrinsics.width;
  p.height = kept->intrinsics.height;
  p.tiles_x = bin.tiles_x;
  p.count = kept->count;
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
  p.gradients = Room(gradients, kept->count);
  double background_gradient[3] = {0, 0, 0};
  p.background_gradient = background_gradient;
  gradient.means2d_abs.assign(options.absgrad ? 2 * static_cast<size_t>(kept->count) : 0, 0.0f);
  p.absolute = options.absgrad ? gradient.means2d_abs.data() : nullptr;
  ParallelFor(0, kept->count, int64_t{1} << 14, [&](int64_t first, int64_t last) {
    std::fill(p.gradients + first, p.gradients + last, BlendGradient{});
  });
  for (int64_t listed_to = 0; listed_to < tile_count;) {
    const int64_t listed_from = listed_to;
    listed_to = listed ? tile_count : EndOfRun(bin, listed_from, options.max_pairs);
    const auto pairs_before = [&](int64_t tile) { return bin.tile_offsets[tile] - bin.tile_offsets[listed_from]; };
    if (!listed) ListPairs(bin, listed_from, listed_to, Room(pairs, pairs_before(listed_to) + bin.chunks));
    for (p.first_tile = listed_from; p.first_tile < listed_to; p.first_tile = p.last_tile) {
      p.last_tile = std::min(listed_to, EndOfRun(bin, p.first_tile, kMaxPartial));
      p.pairs = pairs.data() + pairs_before(p.first_tile);
      const int64_t apart = pairs_before(p.last_tile) - pairs_before(p.first_tile);
      p.partial = ThreadCount() > 1 ? Room(partial, apart) : nullptr;
      p.partial_absolute = ThreadCount() > 1 && options.absgrad ? Room(partial_absolute, 2 * apart) : nullptr;
      BlendBackwardCpu(p);
    }
  }
  for (size_t c = 0; c < 3; ++c) gradient.background[c] = static_cast<float>(background_gradient[c]);
}

void Rasterizer::State::ProjectBackward(const CloudView& cloud, const CoefficientStep* step, CloudGradient& gradient) {
  const size_t n = static_cast<size_t>(kept->count);
  gradient.means.resize(3 * n);
  gradient.log_scales.resize(3 * n);
  gradient.quats.resize(4 * n);
  gradient.opacity_logits.resize(n);
  gradient.sh.resize(step == nullptr ? cloud.sh.size() : 0);
  gradient.means2d.resize(2 * n);
  gradient.radii.assign(radii.begin(), radii.begin() + static_cast<int64_t>(2 * n));

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

  // Both of a chunk while it is in the cache.
  ParallelFor(0, ProjectChunks(kept->count), 1, [&](int64_t first, int64_t last) {
    for (int64_t chunk = first; chunk < last; ++chunk) {
      ProjectBackwardCpu(project, chunk);
      SphericalHarmonicsBackwardCpu(sh, chunk);
    }
  });
}

Status Rasterizer::Backward(const CloudView& cloud, const RenderGradient& output_gradient, CloudGradient& gradient,
                            const CoefficientStep* step) {
  if (!state_->kept) return NoPicture();
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  const State::Kept& kept = *state_->kept;
  if (cloud.size() != kept.count || cloud.sh_degree != kept.sh_degree) {
    return BadGradientArgument(Cat("the picture is of ", WithThousands(kept.count), " Gaussians of SH degree ",
                                   kept.sh_degree, ", not of ", WithThousands(cloud.size()), " of degree ",
                                   cloud.sh_degree));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckGradient(output_gradient, kept.intrinsics.width, kept.intrinsics.height));
  if (step != nullptr && (step->values != cloud.sh.data() || step->columns > cloud.sh_stride() ||
                          step->columns < 3 * ShCoefficients(std::min(kept.options.sh_degree, cloud.sh_degree)))) {
    return BadGradientArgument(Cat("a step of ", step->columns, " coefficients that is not of the picture's cloud"));
  }
  try {
    Stopwatch watch;
    state_->BlendBackward(output_gradient, gradient);
    state_->statistics.blend_backward = watch.Lap();
    state_->ProjectBackward(cloud, step, gradient);
    state_->statistics.project_backward = watch.Lap();
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kIo,
                 Cat("not enough memory for the gradient of ", WithThousands(cloud.size()), " Gaussians")};
  }
  return {};
}

Result<SeenGradient> Rasterizer::BackwardToSeen(const RenderGradient& output_gradient) {
  if (!state_->kept) return NoPicture();
  const State::Kept& kept = *state_->kept;
  ANCHORSPLAT_RETURN_IF_ERROR(CheckGradient(output_gradient, kept.intrinsics.width, kept.intrinsics.height));
  try {
    Stopwatch watch;
    CloudGradient unused;
    state_->BlendBackward(output_gradient, unused);
    state_->statistics.blend_backward = watch.Lap();
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kIo,
                 Cat("not enough memory for the gradient of ", WithThousands(kept.count), " Gaussians")};
  }
  const auto n = static_cast<size_t>(kept.count);
  return SeenGradient{std::span(state_->gradients.data(), n), std::span(state_->projected.data(), n),
                      std::span(state_->radii.data(), 2 * n)};
}

}  // namespace anchorsplat

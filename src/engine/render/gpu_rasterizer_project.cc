#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/buffer.h"
#include "render/gpu_rasterizer.h"
#include "render/project.h"
#include "render/rasterizer_state.h"
#include "render/spherical_harmonics.h"
#include "render/wgsl.h"

namespace anchorsplat {

namespace {

const GpuKernel kProject = {"project", {wgsl::kViewWgsl, wgsl::kAccurateWgsl, wgsl::kUnusualWgsl, wgsl::kProjectWgsl}};
const GpuKernel kColor = {"color",
                          {wgsl::kViewWgsl, wgsl::kAccurateWgsl, wgsl::kUnusualWgsl, wgsl::kSphericalHarmonicsWgsl}};
const GpuKernel kPatchRows = {"patch_rows", {wgsl::kViewWgsl, wgsl::kPatchWgsl}};

struct PatchParameters {
  uint32_t count, unused[3];
};

// x as a sum of two floats.
void Split(double x, float& high, float& low) {
  high = static_cast<float>(x);
  low = static_cast<float>(x - double{high});
}

}  // namespace

// False if the camera exceeds the range of the kernels' floats.
bool GpuRasterizer::MakeView(const GpuCloud& cloud, const Camera& camera, float near, const RenderOptions& options) {
  constexpr double kFarthest = 1e9, kPixels = 1e7, kShortest = 1e-3, kWidest = 1e12, kBrightest = 1e30;
  const Pinhole& k = camera.intrinsics;
  const std::array<double, 3> center = camera.Center();
  bool fits = k.fx >= kShortest && k.fy >= kShortest;
  view = {};
  const auto put = [&fits](double x, double largest, float& high, float& low) {
    fits = fits && std::abs(x) <= largest;
    Split(x, high, low);
  };
  const Pose& pose = camera.world_to_camera;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) put(pose.rotation[3 * i + j], kFarthest, view.r[i][j], view.r_low[i][j]);
    put(pose.translation[i], kFarthest, view.r[i][3], view.r_low[i][3]);
    put(center[i], kFarthest, view.center[i], view.center_low[i]);
    fits = fits && std::abs(options.background[i]) <= kBrightest;
    view.background[i] = options.background[i];
  }
  put(k.fx, kPixels, view.f[0], view.f_low[0]);
  put(k.fy, kPixels, view.f[1], view.f_low[1]);
  put(k.cx, kPixels, view.f[2], view.f_low[2]);
  put(k.cy, kPixels, view.f[3], view.f_low[3]);
  const float dilation = DilationOf(options);
  fits = fits && dilation <= kWidest;
  if (!fits) return false;

  count = cloud.size();
  const int64_t tiles_x = TilesAcross(k.width), tiles_y = TilesAcross(k.height);
  tile_count = tiles_x * tiles_y;
  view.size[0] = static_cast<uint32_t>(k.width), view.size[1] = static_cast<uint32_t>(k.height);
  view.size[2] = static_cast<uint32_t>(tiles_x), view.size[3] = static_cast<uint32_t>(tiles_y);
  view.counts[0] = static_cast<uint32_t>(count);
  view.counts[3] = static_cast<uint32_t>(cloud.sh_stride());
  view.planes[0] = near;
  view.planes[1] = std::min(options.far_plane, std::numeric_limits<float>::max());
  view.planes[2] = dilation;
  view.planes[3] = options.compensated_from;
  view.cuts[0] = options.min_alpha;
  view.cuts[1] = static_cast<float>(std::log2(double{options.min_alpha}));
  view.cuts[2] = MinTransmittance(options);
  view.cuts[3] = kMaxAlpha;
  view.flags[0] = IsCompensated(options.mode) ? 1 : 0;
  view.flags[1] = options.profile == RasterProfile::kGsplat15 ? 1 : 0;
  view.flags[2] = static_cast<uint32_t>(std::min(options.sh_degree, cloud.sh_degree()));
  return true;
}

void GpuRasterizer::Project(GpuCloud& cloud) {
  device->Clear(*unusual, 0, 4);
  unusual_rows.clear();
  for (size_t k = 0; k < cloud.block_count(); ++k) {
    const GpuCloudBlock& block = cloud.Block(*device, k);
    GpuView of_block = view;
    of_block.counts[1] = static_cast<uint32_t>(block.first);
    of_block.counts[2] = static_cast<uint32_t>(block.count);
    const uint32_t groups = GpuWorkgroups(static_cast<uint64_t>(block.count));
    device->Run(kProject, AsParameters(of_block),
                {{1, block.means.get()},
                 {2, block.log_scales.get()},
                 {3, block.quats.get()},
                 {4, block.opacity_logits.get()},
                 {5, seen.get()},
                 {6, rects.get()},
                 {7, radii.get()},
                 {8, unusual.get()}},
                groups);
    device->Run(kColor, AsParameters(of_block),
                {{1, block.means.get()}, {2, block.sh.get()}, {3, rects.get()}, {4, seen.get()}, {8, unusual.get()}},
                groups);
  }
}

// Projects the rows that the kernels skipped.
Status GpuRasterizer::ProjectOnCpu(const GpuCloud& cloud, const Camera& camera, float near,
                                   const RenderOptions& options) {
  std::vector<uint32_t> left(unusual_count);
  const GpuRead read = {unusual.get(), 4, std::as_writable_bytes(std::span(left))};
  ANCHORSPLAT_RETURN_IF_ERROR(device->Read({&read, 1}));
  std::sort(left.begin(), left.end());
  unusual_rows.assign(left.begin(), left.end());
  Result<GaussianCloud> read_rows = cloud.ReadRows(*device, unusual_rows);
  if (!read_rows.ok()) return read_rows.error();
  const CloudView some(*read_rows);

  const size_t n = left.size();
  Buffer<ProjectedGaussian> projected(n);
  std::vector<TileRect> tiles(n);
  std::vector<int32_t> pixels(2 * n), shown(n), shown_counts(static_cast<size_t>(ProjectChunks(some.size())));
  ProjectParams project = ProjectInputs(some, camera, near, options);
  project.projected = projected.data();
  project.tiles = tiles.data();
  project.radii = pixels.data();
  project.visible = shown.data();
  project.visible_counts = shown_counts.data();
  ProjectCpu(project);
  SphericalHarmonicsParams harmonics = SphericalHarmonicsInputs(some, camera, options);
  harmonics.visible = shown.data();
  harmonics.visible_counts = shown_counts.data();
  harmonics.tiles = tiles.data();
  harmonics.projected = projected.data();
  SphericalHarmonicsCpu(harmonics);

  std::vector<GpuSeen> seen_by_cpu(n);
  std::vector<std::array<uint32_t, 2>> packed(n);
  for (size_t i = 0; i < n; ++i) {
    const TileRect& rect = tiles[i];
    if (rect.x1 == 0) continue;
    packed[i] = {rect.x0 | uint32_t{rect.y0} << 16, rect.x1 | uint32_t{rect.y1} << 16};
    const ProjectedGaussian& g = projected[i];
    GpuSeen& s = seen_by_cpu[i];
    Split(g.x, s.at[0], s.at_low[0]);
    Split(g.y, s.at[1], s.at_low[1]);
    s.depth = g.depth, s.log2_opacity = g.log2_opacity, s.compensation = g.compensation;
    s.u[0] = g.u_xx, s.u[1] = g.u_xy, s.u[2] = g.u_yy;
    std::copy_n(g.rgb, 3, s.rgb);
  }
  GpuMemory memory[4];
  const std::span<const std::byte> data[4] = {std::as_bytes(std::span(left)), std::as_bytes(std::span(seen_by_cpu)),
                                              std::as_bytes(std::span(packed)), std::as_bytes(std::span(pixels))};
  for (size_t k = 0; k < 4; ++k) {
    ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, memory[k], data[k].size(), "unusual Gaussians"));
    device->Write(*memory[k], 0, data[k]);
  }
  const PatchParameters parameters = {static_cast<uint32_t>(n), {}};
  device->Run(kPatchRows, AsParameters(parameters),
              {{1, memory[0].get()},
               {2, memory[1].get()},
               {3, memory[2].get()},
               {4, memory[3].get()},
               {5, seen.get()},
               {6, rects.get()},
               {7, radii.get()}},
              GpuWorkgroups(n));
  device->Clear(*unusual, 0, 4);
  return {};
}

}  // namespace anchorsplat

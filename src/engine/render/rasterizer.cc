#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <new>
#include <numeric>

#include "core/finite.h"
#include "core/parallel.h"
#include "core/text.h"
#include "gpu/open_gpu.h"
#include "render/bin.h"
#include "render/blend.h"
#include "render/project.h"
#include "render/rasterizer_state.h"
#include "render/shown_range.h"
#include "render/sort.h"
#include "render/spherical_harmonics.h"

namespace anchorsplat {

namespace {

Error BadArgument(std::string message) { return {ErrorCode::kBadArgument, std::move(message)}; }

Status CheckCamera(const Camera& camera) {
  const Pinhole& k = camera.intrinsics;
  if (k.width < 1 || k.height < 1 || k.width > kMaxImageSide || k.height > kMaxImageSide) {
    return BadArgument(Cat("camera of ", k.width, " x ", k.height, " pixels; each side must be 1 to ", kMaxImageSide));
  }
  if (!(k.fx > 0) || !(k.fy > 0) || !std::isfinite(k.fx) || !std::isfinite(k.fy)) {
    return BadArgument(Cat("camera focal length (", k.fx, ", ", k.fy, ") must be positive and finite"));
  }
  const Pose& pose = camera.world_to_camera;
  if (!std::isfinite(k.cx) || !std::isfinite(k.cy) || !AllFinite(pose.rotation) || !AllFinite(pose.translation)) {
    return BadArgument("camera has a principal point or a pose that is not finite");
  }
  return {};
}

Status CheckOptions(const RenderOptions& o) {
  if (!(o.near_plane > 0)) return BadArgument(Cat("near plane ", o.near_plane, " must be positive"));
  const float dilation = DilationOf(o);
  if (!(dilation >= 0) || !std::isfinite(dilation)) {
    return BadArgument(Cat("dilation ", dilation, " must not be negative"));
  }
  if (!(o.compensated_from >= 0 && o.compensated_from <= dilation)) {
    return BadArgument(Cat("compensated_from ", o.compensated_from, " is not between 0 and the dilation ", dilation));
  }
  if (o.sh_degree < 0) return BadArgument(Cat("SH degree ", o.sh_degree, " must not be negative"));
  if (!(o.min_alpha > 0 && o.min_alpha < 1)) return BadArgument(Cat("min_alpha ", o.min_alpha, " is not in (0, 1)"));
  if (!(o.min_transmittance >= 0 && o.min_transmittance < 1)) {
    return BadArgument(Cat("min_transmittance ", o.min_transmittance, " is not in [0, 1)"));
  }
  if (o.max_pairs < 1 || o.max_pairs > int64_t{1} << 31) {
    return BadArgument(Cat("max_pairs ", o.max_pairs, " is not 1 to 2^31"));
  }
  return {};
}

void Shape(int width, int height, int channels, Image& image) {
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.pixels.resize(static_cast<size_t>(channels) * static_cast<size_t>(image.plane()));
}

}  // namespace

void ShapeFor(const Camera& camera, const RenderOptions& options, RenderOutput& output) {
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  Shape(width, height, 3, output.color);
  Shape(width, height, 1, output.alpha);
  if (options.depth) {
    Shape(width, height, 1, output.depth);
  } else {
    output.depth = Image();
  }
}

ProjectParams ProjectInputs(const CloudView& cloud, const Camera& camera, float near, const RenderOptions& options) {
  ProjectParams project{};
  project.count = cloud.size();
  project.means = cloud.means.data();
  project.log_scales = cloud.log_scales.data();
  project.quats = cloud.quats.data();
  project.opacity_logits = cloud.opacity_logits.data();
  project.intrinsics = camera.intrinsics;
  project.world_to_camera = camera.world_to_camera;
  project.profile = options.profile;
  project.mode = options.mode;
  project.near_plane = near;
  project.far_plane = options.far_plane;
  project.dilation = DilationOf(options);
  project.compensated_from = options.compensated_from;
  project.min_alpha = options.min_alpha;
  return project;
}

SphericalHarmonicsParams SphericalHarmonicsInputs(const CloudView& cloud, const Camera& camera,
                                                  const RenderOptions& options) {
  SphericalHarmonicsParams sh{};
  sh.count = cloud.size();
  sh.degree = std::min(options.sh_degree, cloud.sh_degree);
  sh.stride = cloud.sh_stride();
  sh.means = cloud.means.data();
  sh.sh = cloud.sh.data();
  sh.center = camera.Center();
  return sh;
}

// Projects and colours Gaussians; returns the number of visible ones.
int64_t Rasterizer::State::Project(const CloudView& cloud, const Camera& camera, float near,
                                   const RenderOptions& options, Stopwatch& watch) {
  const int64_t n = cloud.size();
  const int64_t chunks = ProjectChunks(n);
  ProjectParams project = ProjectInputs(cloud, camera, near, options);
  project.projected = Room(projected, n);
  project.tiles = Room(tiles, n);
  project.radii = options.gradient ? Room(radii, 2 * n) : nullptr;
  project.visible = Room(visible, n);
  project.visible_counts = Room(visible_counts, chunks);
  project.slot_counts = options.gradient ? Room(slot_counts, chunks) : nullptr;
  ProjectCpu(project);
  statistics.project = watch.Lap();

  SphericalHarmonicsParams sh = SphericalHarmonicsInputs(cloud, camera, options);
  sh.visible = visible.data();
  sh.visible_counts = visible_counts.data();
  sh.tiles = tiles.data();
  sh.projected = projected.data();
  SphericalHarmonicsCpu(sh);
  statistics.spherical_harmonics = watch.Lap();
  return std::accumulate(visible_counts.data(), visible_counts.data() + chunks, int64_t{0});
}

// Number of pieces for manually split per-Gaussian work: enough for all threads, but few enough that their tables do
// not dominate.
int64_t PieceCount(int64_t count) { return std::clamp<int64_t>(count / 4096, 1, ThreadCount()); }

// Sorts the visible Gaussians by depth into `rows`; stable.
void Rasterizer::State::Sort(int64_t count, int64_t total) {
  SortParams sort{};
  sort.count = total;
  sort.keys = Room(keys, total);
  sort.rows = Room(rows, total);
  sort.spare_keys = Room(spare_keys, total);
  sort.spare_rows = Room(spare_rows, total);
  sort.chunks = PieceCount(total);
  sort.histograms = Room(histograms, sort.chunks * kSortBuckets);
  // Compacts the chunks' lists.
  const int64_t chunk_total = ProjectChunks(count);
  int64_t* starts = Room(visible_starts, chunk_total);
  std::exclusive_scan(visible_counts.data(), visible_counts.data() + chunk_total, starts, int64_t{0});
  ParallelFor(0, chunk_total, 4, [&](int64_t first, int64_t last) {
    for (int64_t chunk = first; chunk < last; ++chunk) {
      const int32_t* from = visible.data() + chunk * kProjectChunk;
      const int64_t to = starts[chunk];
      for (int64_t k = 0; k < visible_counts[static_cast<size_t>(chunk)]; ++k) {
        const int32_t i = from[k];
        sort.rows[to + k] = i;
        // Depths are positive (beyond the near plane), so their bits sort like floats.
        sort.keys[to + k] = std::bit_cast<uint32_t>(projected[static_cast<size_t>(i)].depth);
      }
    }
  });
  SortCpu(sort);
}

BinParams Rasterizer::State::MakeBinParams(int64_t visible_total, const Pinhole& intrinsics, float min_alpha) {
  BinParams bin{};
  bin.count = visible_total;
  bin.order = rows.data();
  bin.tiles = tiles.data();
  bin.projected = projected.data();
  bin.min_alpha = min_alpha;
  bin.tiles_x = TilesAcross(intrinsics.width);
  bin.tiles_y = TilesAcross(intrinsics.height);
  bin.chunks = PieceCount(visible_total);
  const int64_t tile_count = int64_t{bin.tiles_x} * bin.tiles_y;
  bin.tiles_by_depth = Room(tiles_by_depth, visible_total);
  bin.chunk_counts = Room(chunk_counts, bin.chunks * tile_count);
  bin.tile_offsets = Room(tile_offsets, tile_count + 1);
  return bin;
}

void Rasterizer::State::BinAndBlend(int64_t visible_total, const Camera& camera, const RenderOptions& options,
                                    RenderOutput& output, Stopwatch& watch) {
  const BinParams bin = MakeBinParams(visible_total, camera.intrinsics, options.min_alpha);
  const int64_t tile_count = int64_t{bin.tiles_x} * bin.tiles_y;
  CountPairs(bin);
  statistics.pairs = bin.tile_offsets[tile_count];

  BlendParams blend{};
  blend.width = camera.intrinsics.width;
  blend.height = camera.intrinsics.height;
  blend.tiles_x = bin.tiles_x;
  blend.projected = projected.data();
  blend.tile_offsets = bin.tile_offsets;
  std::copy(options.background.begin(), options.background.end(), blend.background);
  blend.min_alpha = options.min_alpha;
  blend.min_transmittance = MinTransmittance(options);
  blend.color = output.color.pixels.data();
  blend.alpha = output.alpha.pixels.data();
  blend.depth = options.depth ? output.depth.pixels.data() : nullptr;
  const int64_t pixels = int64_t{blend.width} * blend.height;
  blend.transmittance = options.gradient ? Room(transmittance, pixels) : nullptr;
  blend.contributors = options.gradient ? Room(contributors, pixels) : nullptr;
  blend.evaluations = Room(evaluations, tile_count);
  statistics.bin = watch.Lap();
  statistics.blend = 0;
  statistics.runs = 0;
  for (int64_t first = 0; first < tile_count; first = blend.last_tile) {
    blend.first_tile = first;
    blend.last_tile = EndOfRun(bin, first, options.max_pairs);
    int32_t* list = Room(pairs, bin.tile_offsets[blend.last_tile] - bin.tile_offsets[first] + bin.chunks);
    ListPairs(bin, first, blend.last_tile, list);
    statistics.bin += watch.Lap();
    blend.pairs = list;
    BlendCpu(blend);
    statistics.blend += watch.Lap();
    ++statistics.runs;
  }
  statistics.evaluations = std::accumulate(blend.evaluations, blend.evaluations + tile_count, int64_t{0});
}

void Rasterizer::State::DrawOnCpu(const CloudView& cloud, const Camera& camera, float near,
                                  const RenderOptions& options, RenderOutput& output) {
  Stopwatch watch;
  const int64_t total = Project(cloud, camera, near, options, watch);
  statistics.visible = total;
  Sort(cloud.size(), total);
  statistics.sort = watch.Lap();
  BinAndBlend(total, camera, options, output, watch);
}

GpuRasterizer* Rasterizer::State::OpenGpu() {
  Result<std::shared_ptr<GpuDevice>> opened = GpuOfRun();
  if (!opened.ok()) GiveUpGpu(opened.error());
  const std::shared_ptr<GpuDevice> device = opened.ok() ? *opened : nullptr;
  if (device == nullptr || gpu == nullptr || gpu->device != device) {
    DropGpu();
    if (device != nullptr) gpu = std::make_unique<GpuRasterizer>(device);
  }
  return gpu.get();
}

Result<GpuCloud*> Rasterizer::State::Upload(const Source& source) {
  if (source.constant != nullptr) {
    gpu_cloud = GpuCloud();
    return source.constant->On(gpu->device);
  }
  ANCHORSPLAT_RETURN_IF_ERROR(gpu_cloud.Assign(*gpu->device, source.cloud));
  return &gpu_cloud;
}

bool Rasterizer::State::DrawOnGpu(const Source& source, const Camera& camera, float near, const RenderOptions& options,
                                  RenderOutput& output) {
  if (OpenGpu() == nullptr) {
    if (source.constant != nullptr) source.constant->Release();
    return false;
  }
  Stopwatch watch;
  const Result<GpuCloud*> uploaded = Upload(source);
  const Result<bool> drawn =
      uploaded.ok() ? gpu->Draw(**uploaded, camera, near, options, &output) : Result<bool>(uploaded.error());
  if (!drawn.ok()) {
    DropGpu();
    if (source.constant != nullptr) source.constant->Release();
    GiveUpGpu(drawn.error());
    return false;
  }
  if (!*drawn) return false;
  statistics = {};
  statistics.blend = watch.Lap();
  statistics.visible = gpu->visible;
  statistics.pairs = gpu->total_pairs;
  statistics.runs = gpu->runs;
  if (source.constant != nullptr) source.constant->NotePairs(gpu->total_pairs);
  return true;
}

Rasterizer::Rasterizer() : state_(std::make_unique<State>()) {}
Rasterizer::~Rasterizer() = default;
Rasterizer::Rasterizer(Rasterizer&&) noexcept = default;
Rasterizer& Rasterizer::operator=(Rasterizer&&) noexcept = default;

const RenderStatistics& Rasterizer::statistics() const { return state_->statistics; }

Status ValidateRender(const Camera& camera, const RenderOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCamera(camera));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckOptions(options));
  const float near = NearPlane(options, camera);
  if (!(options.far_plane > near)) {
    return BadArgument(Cat("far plane ", options.far_plane, " must lie behind the near plane, which is at ", near));
  }
  return {};
}

Status Rasterizer::Render(const CloudView& cloud, const Camera& camera, const RenderOptions& options,
                          RenderOutput& output) {
  return RenderSource({cloud}, camera, options, output);
}

Status Rasterizer::Render(ConstantCloud& cloud, const Camera& camera, const RenderOptions& options,
                          RenderOutput& output) {
  return RenderSource({cloud.view(), &cloud}, camera, options, output);
}

Status Rasterizer::RenderSource(const Source& source, const Camera& world_camera, const RenderOptions& options,
                                RenderOutput& output) {
  const CloudView& cloud = source.cloud;
  state_->kept.reset();
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  ANCHORSPLAT_RETURN_IF_ERROR(ValidateRender(world_camera, options));
  const float near = NearPlane(options, world_camera);
  if (cloud.size() > std::numeric_limits<int32_t>::max()) {
    return BadArgument(Cat("cloud of ", WithThousands(cloud.size()), " Gaussians; at most 2,147,483,647 can be drawn"));
  }
  Camera camera;
  camera.intrinsics = world_camera.intrinsics;
  camera.world_to_camera = RelativeToOrigin(world_camera.world_to_camera, cloud.origin);
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  try {
    ShapeFor(camera, options, output);
    const bool on_gpu = state_->DrawOnGpu(source, camera, near, options, output);
    if (!on_gpu) state_->DrawOnCpu(cloud, camera, near, options, output);
    if (options.gradient) {
      state_->kept = {.intrinsics = camera.intrinsics,
                      .world_to_camera = camera.world_to_camera,
                      .center = camera.Center(),
                      .near = near,
                      .options = options,
                      .count = cloud.size(),
                      .sh_degree = cloud.sh_degree,
                      .on_gpu = on_gpu};
    }
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kIo, Cat("not enough memory for a picture of ", width, " x ", height, " pixels of ",
                                     WithThousands(cloud.size()), " Gaussians")};
  }
  return {};
}

}  // namespace anchorsplat

#include "render/gpu_rasterizer_backward.h"

#include <algorithm>
#include <array>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"
#include "render/blend_backward.h"
#include "render/constants.h"
#include "render/gpu_layout.h"
#include "render/gpu_sort.h"
#include "render/project.h"
#include "render/project_backward.h"
#include "render/wgsl.h"

namespace anchorsplat {

namespace {

// Group size of blend_backward.wgsl: uses all workgroup memory, and absolute sums need more per Gaussian.
constexpr std::string_view kPlainSums =
    "const ABSOLUTE = false;\nconst GROUP = 8u;\nconst VALUES = 6u;\nconst SUMS = 9u;\n";
constexpr std::string_view kAbsoluteSums =
    "const ABSOLUTE = true;\nconst GROUP = 4u;\nconst VALUES = 8u;\nconst SUMS = 11u;\n";
constexpr uint32_t kSums = 9, kSumsWithAbsolute = 11;

const GpuKernel kBlendBackward = {"blend_backward",
                                  {wgsl::kViewWgsl, wgsl::kAlphaWgsl, kPlainSums, wgsl::kBlendBackwardWgsl}};
const GpuKernel kBlendBackwardAbsolute = {"blend_backward",
                                          {wgsl::kViewWgsl, wgsl::kAlphaWgsl, kAbsoluteSums, wgsl::kBlendBackwardWgsl}};
const GpuKernel kBlendBackground = {"blend_background", {wgsl::kViewWgsl, wgsl::kBlendBackgroundWgsl}};
const GpuKernel kCountSlots = {"count_slots", {wgsl::kViewWgsl, wgsl::kGatherSlotsWgsl}};
const GpuKernel kGatherSlots = {"gather_slots", {wgsl::kViewWgsl, wgsl::kGatherSlotsWgsl}};
const GpuKernel kShapes = {"project_backward_shapes",
                           {wgsl::kViewWgsl, wgsl::kAccurateWgsl, wgsl::kProjectBackwardWgsl}};
const GpuKernel kPlaces = {"project_backward_places",
                           {wgsl::kViewWgsl, wgsl::kAccurateWgsl, wgsl::kProjectBackwardWgsl}};
const GpuKernel kCopyAbsolute = {"copy_absolute", {wgsl::kViewWgsl, wgsl::kAccurateWgsl, wgsl::kProjectBackwardWgsl}};
const GpuKernel kSphericalHarmonics = {"spherical_harmonics_backward",
                                       {wgsl::kViewWgsl, wgsl::kSphericalHarmonicsBackwardWgsl}};

struct BlendParameters {
  float background[4];
  uint32_t size[4], box[4], run[4];
  uint32_t first_row, unused;
  float cuts[2];
};
struct BackgroundParameters {
  uint32_t size[4], box[4], first_row, unused[3];
};
struct GatherParameters {
  uint32_t size[4], more[4];
};

constexpr int64_t kSlotBytes = 52;                  // a touched flag and twelve numbers
constexpr int64_t kSlotAlignment = 64;              // aligns the numbers to 256 bytes
constexpr int64_t kFewestSlots = int64_t{1} << 10;  // lower limit of attempts
constexpr int64_t kRowsAtOnce = int64_t{1} << 18;   // rows of a GpuGradient: 64 MiB at degree 3
constexpr int64_t kShRows = 64;                     // Gaussians per workgroup of the SH stage
static_assert(kRowsAtOnce % kGpuWorkgroupSize == 0 && kGpuWorkgroupSize % kShRows == 0);

uint32_t Word(int64_t value) { return static_cast<uint32_t>(value); }

uint64_t LargestBinding(const GpuDevice& device) {
  return std::min({device.adapter().max_binding, device.adapter().max_buffer, uint64_t{1} << 40});
}

// Bytes of a gradient with this many rows.
Status MakeRoom(const GpuRasterizer& rasterizer, int64_t rows, int64_t sh_stride, bool absolute, GpuGradient& g) {
  const auto room = [&](GpuMemory& memory, int64_t floats) {
    return EnsureGpuMemory(*rasterizer.device, memory, static_cast<uint64_t>(4 * floats * rows),
                           "the gradient of a splat");
  };
  ANCHORSPLAT_RETURN_IF_ERROR(room(g.means, 3));
  ANCHORSPLAT_RETURN_IF_ERROR(room(g.log_scales, 3));
  ANCHORSPLAT_RETURN_IF_ERROR(room(g.quats, 4));
  ANCHORSPLAT_RETURN_IF_ERROR(room(g.opacity_logits, 1));
  ANCHORSPLAT_RETURN_IF_ERROR(room(g.sh, sh_stride));
  ANCHORSPLAT_RETURN_IF_ERROR(room(g.means2d, 2));
  if (!absolute) {
    g.means2d_abs.reset();
    return {};
  }
  return room(g.means2d_abs, 2);
}

bool HasNone(const BlendGradient& b) {
  return b.q == 0 && b.qu == 0 && b.qv == 0 && b.quu == 0 && b.quv == 0 && b.qvv == 0;
}

}  // namespace

ProjectedGaussian FromGpu(const GpuSeen& seen) {
  ProjectedGaussian g{};
  g.x = double{seen.at[0]} + double{seen.at_low[0]};
  g.y = double{seen.at[1]} + double{seen.at_low[1]};
  g.u_xx = seen.u[0], g.u_xy = seen.u[1], g.u_yy = seen.u[2];
  g.log2_opacity = seen.log2_opacity, g.depth = seen.depth, g.compensation = seen.compensation;
  std::copy_n(seen.rgb, 3, g.rgb);
  return g;
}

BlendGradient FromGpu(const std::array<float, 12>& sums) {
  return {sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], {sums[6], sums[7], sums[8]}};
}

// A run of tiles whose slots are allocated at once.
struct GpuRasterizerBackward::Run {
  int64_t first, last;      // tiles
  int64_t listed_first;     // tile of ranges[0]
  int64_t slots = 0;        // in the run, rounded up
  bool first_sums = false;  // the first run
  PixelBox box;
  const GpuBuffer* pixels = nullptr;
  int64_t pixel_row = 0;  // first row of the picture in `pixels`
};

Status GpuRasterizerBackward::MakeRoomForSums() {
  GpuRasterizer& r = *rasterizer_;
  const auto n = static_cast<uint64_t>(r.count);
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*r.device, sums_, 48 * n, "what pixels say of the Gaussians"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*r.device, starts_, GpuScanBytes(n), "the places of sums"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*r.device, lengths_, 64, "the length of a scan"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*r.device, totals_, 64, "the total of a scan"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*r.device, many_, 4, "the total of a scan"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*r.device, backgrounds_, static_cast<uint64_t>(16 * r.tile_count),
                                              "the gradient of the background"));
  const std::array<uint32_t, 1> length = {Word(r.count)};
  r.device->Write(*lengths_, 4 * kSizeGaussians, std::as_bytes(std::span(length)));
  return {};
}

// Uploads rows [first_row, last_row) of the picture, clipped to the box.
Status GpuRasterizerBackward::Upload(const RenderGradient& gradient, int first_row, int last_row) {
  const PixelBox& box = gradient.box;
  const int64_t across = box.x1 - box.x0, rows = last_row - first_row;
  const size_t floats = static_cast<size_t>(4 * across * rows);
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*rasterizer_->device, pixels_, 4 * floats, "the gradient of a picture"));
  if (staging_.size() < floats) staging_.resize(floats);
  const int64_t width = gradient.color.width, plane = gradient.color.plane();
  const float* color = gradient.color.pixels.data();
  const float* alpha = gradient.alpha.pixels.empty() ? nullptr : gradient.alpha.pixels.data();
  ParallelFor(0, rows, 16, [&](int64_t first, int64_t last) {
    for (int64_t row = first; row < last; ++row) {
      float* to = staging_.data() + 4 * across * row;
      for (int64_t at = (first_row + row) * width + box.x0, end = at + across; at < end; ++at, to += 4) {
        to[0] = color[at];
        to[1] = color[at + plane];
        to[2] = color[at + 2 * plane];
        to[3] = alpha != nullptr ? alpha[at] : 0.0f;
      }
    }
  });
  rasterizer_->device->Write(*pixels_, 0, std::as_bytes(std::span(staging_.data(), floats)));
  return {};
}

void GpuRasterizerBackward::CountSlots(const Run& run) {
  GpuRasterizer& r = *rasterizer_;
  const GatherParameters parameters = {{Word(r.count), r.view.size[2], Word(run.first), Word(run.last)}, {}};
  r.device->Clear(*many_, 0, 4);
  r.device->Run(kCountSlots, AsParameters(parameters), {{1, r.rects.get()}, {2, starts_.get()}, {7, many_.get()}},
                GpuWorkgroups(static_cast<uint64_t>(r.count)));
  ScanOnGpu(*r.device, {*lengths_, kSizeGaussians, *starts_, *totals_, static_cast<uint64_t>(r.count)});
}

// Shortens the run until its slots fit: at most kMaxGpuSlots and what the device can allocate.
Status GpuRasterizerBackward::PlaceSlots(Run& run) {
  GpuRasterizer& r = *rasterizer_;
  const auto room = [&](int64_t slots) {
    run.slots = (std::max<int64_t>(slots, 1) + kSlotAlignment - 1) / kSlotAlignment * kSlotAlignment;
    return EnsureGpuMemory(*r.device, slots_, static_cast<uint64_t>(kSlotBytes * run.slots), "the sums of tiles");
  };
  const auto fit = static_cast<int64_t>(LargestBinding(*r.device) / kSlotBytes);
  int64_t most = std::min(kMaxGpuSlots, fit / kSlotAlignment * kSlotAlignment);
  // Almost always all fit, and then no wait for their number is needed.
  if (r.most_tiles <= most && room(r.most_tiles).ok()) {
    CountSlots(run);
    return {};
  }
  for (;; run.last = run.first + std::max<int64_t>(1, (run.last - run.first) / 2)) {
    CountSlots(run);
    uint32_t total = 0, many = 0;
    const std::array<GpuRead, 2> reads = {
        {{totals_.get(), 4 * uint64_t{kSizeGaussians}, std::as_writable_bytes(std::span(&total, 1))},
         {many_.get(), 0, std::as_writable_bytes(std::span(&many, 1))}}};
    ANCHORSPLAT_RETURN_IF_ERROR(r.device->Read(reads));
    const int64_t slots = std::max(int64_t{total}, 32 * int64_t{many});  // the second reveals an overflow of the first
    const bool shortest = run.last == run.first + 1;
    if (slots <= most) {
      Status status = room(slots);
      if (status.ok()) return {};
      most = slots / 2;
      if (shortest || most < kFewestSlots) return status;
    } else if (shortest) {
      return Error{ErrorCode::kIo, Cat(WithThousands(slots),
                                       " Gaussians on a tile of 16 x 16 pixels are more than the GPU can add up")};
    }
  }
}

void GpuRasterizerBackward::BlendRun(const RenderOptions& options, const Run& run) {
  GpuRasterizer& r = *rasterizer_;
  const PixelBox& box = run.box;
  const std::array<uint32_t, 4> corners = {Word(box.x0), Word(box.y0), Word(box.x1), Word(box.y1)};
  const int64_t width = r.view.size[0], tiles_x = r.view.size[2];
  const BackgroundParameters background = {{Word(width), Word(tiles_x), Word(run.first), Word(run.last - run.first)},
                                           {corners[0], corners[1], corners[2], corners[3]},
                                           Word(run.pixel_row),
                                           {}};
  r.device->Run(kBlendBackground, AsParameters(background),
                {{1, r.kept.get()}, {2, run.pixels}, {3, backgrounds_.get()}}, Word(run.last - run.first));
  if (r.count == 0) return;

  const auto sums_at = Word(r.count);  // offset of the scan's sums
  r.device->Clear(*slots_, 0, static_cast<uint64_t>(4 * run.slots));
  if (r.total_pairs > 0) {
    BlendParameters blend{};
    std::copy(options.background.begin(), options.background.end(), blend.background);
    std::copy_n(r.view.size, 3, blend.size);
    blend.size[3] = Word(run.first);
    std::copy(corners.begin(), corners.end(), blend.box);
    blend.run[0] = Word(run.last - run.first), blend.run[1] = Word(run.listed_first);
    blend.run[2] = Word(run.slots), blend.run[3] = sums_at;
    blend.first_row = Word(run.pixel_row);
    blend.cuts[0] = r.view.cuts[1], blend.cuts[1] = r.view.cuts[3];
    r.device->Run(options.absgrad ? kBlendBackwardAbsolute : kBlendBackward, AsParameters(blend),
                  {{1, r.seen.get()},
                   {2, r.ranges.get()},
                   {3, r.pairs[r.listed].get()},
                   {4, r.kept.get()},
                   {5, run.pixels},
                   {6, r.rects.get()},
                   {7, starts_.get()},
                   {8, slots_.get()}},
                  Word(run.last - run.first));
  }
  const GatherParameters gather = {{Word(r.count), Word(tiles_x), Word(run.first), Word(run.last)},
                                   {run.first_sums ? 1u : 0u, options.absgrad ? kSumsWithAbsolute : kSums, sums_at, 0}};
  const auto touched = static_cast<uint64_t>(4 * run.slots);
  r.device->Run(kGatherSlots, AsParameters(gather),
                {{1, r.rects.get()},
                 {3, starts_.get()},
                 {4, slots_.get(), 0, touched},
                 {5, slots_.get(), touched, 12 * touched},
                 {6, sums_.get()}},
                GpuWorkgroups(12 * static_cast<uint64_t>(r.count)));
}

// For a gradient on the GPU or, in pieces if too long for a binding, in host memory.
Status GpuRasterizerBackward::BlendAll(const RenderOptions& options, const GpuPictureGradient& gradient,
                                       const RenderGradient* host) {
  GpuRasterizer& r = *rasterizer_;
  const PixelBox& box = gradient.box;
  const int64_t tiles_x = r.view.size[2];
  ANCHORSPLAT_RETURN_IF_ERROR(MakeRoomForSums());
  first_tile_ = last_tile_ = 0;
  if (box.empty()) {
    r.device->Clear(*sums_, 0, static_cast<uint64_t>(48 * r.count));
    return {};
  }
  // No other tile has a gradient.
  first_tile_ = box.y0 / kTile * tiles_x;
  last_tile_ = std::min(r.tile_count, int64_t{(box.y1 - 1) / kTile + 1} * tiles_x);
  const auto rows_that_fit =
      static_cast<int64_t>(LargestBinding(*r.device)) / (int64_t{16} * (int64_t{box.x1} - box.x0));
  const bool at_once = int64_t{box.y1 - box.y0} <= rows_that_fit;
  const int64_t tile_rows = at_once ? r.view.size[3] : std::max<int64_t>(1, rows_that_fit / kTile);
  if (host != nullptr && at_once) ANCHORSPLAT_RETURN_IF_ERROR(Upload(*host, box.y0, box.y1));

  // The list of the last run of tiles is still there: with one run that is all of them.
  const bool listed = r.runs == 1;
  int64_t tiles_at_once = last_tile_ - first_tile_;
  Run run{};
  run.box = box;
  for (int64_t listed_to = first_tile_; listed_to < last_tile_;) {
    run.listed_first = listed ? 0 : listed_to;
    const int64_t listed_from = listed_to;
    listed_to = listed ? last_tile_ : r.EndOfRun(listed_from, last_tile_);
    if (!listed) r.ListRun(listed_from, listed_to);
    for (run.first = listed_from; run.first < listed_to; run.first = run.last) {
      run.last = std::min({listed_to, (run.first / tiles_x + tile_rows) * tiles_x, run.first + tiles_at_once});
      if (r.count > 0) ANCHORSPLAT_RETURN_IF_ERROR(PlaceSlots(run));
      tiles_at_once = 2 * (run.last - run.first);  // the next run is hardly longer
      if (host != nullptr) {
        run.pixel_row = box.y0;
        if (!at_once) {
          run.pixel_row = std::max<int64_t>(box.y0, run.first / tiles_x * kTile);
          const int64_t end = std::min<int64_t>(box.y1, ((run.last - 1) / tiles_x + 1) * kTile);
          ANCHORSPLAT_RETURN_IF_ERROR(Upload(*host, static_cast<int>(run.pixel_row), static_cast<int>(end)));
        }
        run.pixels = pixels_.get();
      } else {
        run.pixel_row = box.y0;
        run.pixels = gradient.pixels;
      }
      run.first_sums = run.first == first_tile_;
      BlendRun(options, run);
    }
  }
  r.device->Submit();
  return {};
}

Status GpuRasterizerBackward::Blend(const RenderOptions& options, const GpuPictureGradient& gradient) {
  return BlendAll(options, gradient, nullptr);
}

Status GpuRasterizerBackward::Blend(const RenderOptions& options, const RenderGradient& gradient) {
  return BlendAll(options, {nullptr, gradient.box}, &gradient);
}

Status GpuRasterizerBackward::ReadBackground(std::span<float, 3> background) {
  std::vector<std::array<float, 4>> tiles(static_cast<size_t>(last_tile_ - first_tile_));
  double sums[3] = {0, 0, 0};
  if (!tiles.empty()) {
    const std::array<GpuRead, 1> read = {
        GpuRead{backgrounds_.get(), static_cast<uint64_t>(16 * first_tile_), std::as_writable_bytes(std::span(tiles))}};
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_->device->Read(read));
  }
  for (const std::array<float, 4>& tile : tiles) {
    for (size_t c = 0; c < 3; ++c) sums[c] += tile[c];
  }
  for (size_t c = 0; c < 3; ++c) background[c] = static_cast<float>(sums[c]);
  return {};
}

Status GpuRasterizerBackward::Project(GpuCloud& cloud, const RenderOptions& options,
                                      const std::function<Status(const GpuGradient&)>& use) {
  GpuRasterizer& r = *rasterizer_;
  GpuGradient& g = gradient_;
  const auto stride = cloud.sh_stride();
  const int64_t fit = static_cast<int64_t>(LargestBinding(*r.device)) / std::max<int64_t>(64, 4 * stride);  // rows
  int64_t most = std::min(
      r.count, std::clamp<int64_t>(fit / kGpuWorkgroupSize * kGpuWorkgroupSize, kGpuWorkgroupSize, kRowsAtOnce));
  Status room = MakeRoom(r, most, stride, options.absgrad, g);
  if (!room.ok()) {  // Blend's memory is free now
    slots_.reset();
    pixels_.reset();
    room = MakeRoom(r, most, stride, options.absgrad, g);
  }
  while (!room.ok() && most > kGpuWorkgroupSize) {
    most = (most / 2 + kGpuWorkgroupSize - 1) / kGpuWorkgroupSize * kGpuWorkgroupSize;
    room = MakeRoom(r, most, stride, options.absgrad, g);
  }
  if (!room.ok()) return room;
  for (size_t k = 0; k < cloud.block_count(); ++k) {
    const GpuCloudBlock& block = cloud.Block(*r.device, k);
    for (int64_t offset = 0; offset < block.count; offset += most) {
      g.block = k, g.offset = offset, g.first = block.first + offset, g.count = std::min(most, block.count - offset);
      GpuView view = r.view;
      view.counts[0] = Word(r.count), view.counts[1] = Word(g.first);
      view.counts[2] = Word(g.count), view.counts[3] = Word(stride);
      const auto rows_of = [&](uint32_t index, const GpuMemory& memory, int64_t first, int64_t floats) {
        return GpuBinding{index, memory.get(), static_cast<uint64_t>(4 * floats * first),
                          static_cast<uint64_t>(4 * floats * g.count)};
      };
      const GpuBinding seen = rows_of(1, r.seen, g.first, 16), sums = rows_of(2, sums_, g.first, 12);
      const GpuBinding log_scales = rows_of(3, block.log_scales, offset, 3);
      const GpuBinding quats = rows_of(4, block.quats, offset, 4);
      const uint32_t groups = GpuWorkgroups(static_cast<uint64_t>(g.count));
      r.device->Run(kShapes, AsParameters(view),
                    {seen,
                     sums,
                     log_scales,
                     quats,
                     rows_of(5, block.opacity_logits, offset, 1),
                     {6, g.log_scales.get()},
                     {7, g.quats.get()},
                     {8, g.opacity_logits.get()}},
                    groups);
      r.device->Run(kPlaces, AsParameters(view),
                    {seen, sums, log_scales, quats, {5, g.means.get()}, {6, g.means2d.get()}}, groups);
      if (options.absgrad) r.device->Run(kCopyAbsolute, AsParameters(view), {sums, {3, g.means2d_abs.get()}}, groups);
      ANCHORSPLAT_RETURN_IF_ERROR(ProjectUnusual(cloud, options, g));
      r.device->Run(kSphericalHarmonics, AsParameters(view),
                    {seen,
                     sums,
                     rows_of(3, block.means, offset, 3),
                     rows_of(4, block.sh, offset, stride),
                     {5, g.means.get()},
                     {6, g.sh.get()}},
                    static_cast<uint32_t>((g.count + kShRows - 1) / kShRows));
      ANCHORSPLAT_RETURN_IF_ERROR(use(g));
    }
  }
  r.device->Submit();
  return {};
}

// Gradient of rows that were projected on the CPU (render/unusual.wgsl).
Status GpuRasterizerBackward::ProjectUnusual(const GpuCloud& cloud, const RenderOptions& options,
                                             const GpuGradient& gradient) {
  const GpuRasterizer& r = *rasterizer_;
  const auto begin = std::lower_bound(r.unusual_rows.begin(), r.unusual_rows.end(), gradient.first);
  const auto end = std::lower_bound(begin, r.unusual_rows.end(), gradient.first + gradient.count);
  const std::vector<int64_t> rows(begin, end);
  if (rows.empty()) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud some, cloud.ReadRows(*r.device, rows));
  const size_t n = rows.size();
  std::vector<GpuSeen> seen(n);
  std::vector<std::array<float, 12>> sums(n);
  std::vector<GpuRead> reads;
  for (size_t k = 0; k < n; ++k) {
    const auto row = static_cast<uint64_t>(rows[k]);
    reads.push_back({r.seen.get(), sizeof(GpuSeen) * row, std::as_writable_bytes(std::span(&seen[k], 1))});
    reads.push_back({sums_.get(), 48 * row, std::as_writable_bytes(std::span(sums[k]))});
  }
  ANCHORSPLAT_RETURN_IF_ERROR(r.device->Read(reads));

  std::vector<ProjectedGaussian> projected(n);
  std::vector<BlendGradient> gradients(n);
  std::vector<int32_t> visible(n), visible_counts(static_cast<size_t>(ProjectChunks(some.size())));
  for (size_t k = 0; k < n; ++k) {
    projected[k] = FromGpu(seen[k]);
    gradients[k] = FromGpu(sums[k]);
    // Culled ones have no sums and undefined `seen`.
    if (HasNone(gradients[k])) continue;
    const size_t chunk = k / kProjectChunk;
    visible[chunk * kProjectChunk + static_cast<size_t>(visible_counts[chunk]++)] = static_cast<int32_t>(k);
  }
  Buffer<float> means(3 * n), log_scales(3 * n), quats(4 * n), opacity_logits(n), means2d(2 * n);
  ProjectBackwardParams p{};
  p.count = some.size();
  p.means = some.means.data();
  p.log_scales = some.log_scales.data();
  p.quats = some.quats.data();
  p.opacity_logits = some.opacity_logits.data();
  const auto whole = [](const float* high, const float* low, size_t k) { return double{high[k]} + double{low[k]}; };
  const GpuView& view = r.view;
  p.intrinsics = {static_cast<int>(view.size[0]), static_cast<int>(view.size[1]), whole(view.f, view.f_low, 0),
                  whole(view.f, view.f_low, 1),   whole(view.f, view.f_low, 2),   whole(view.f, view.f_low, 3)};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) p.world_to_camera.rotation[3 * i + j] = whole(view.r[i], view.r_low[i], j);
    p.world_to_camera.translation[i] = whole(view.r[i], view.r_low[i], 3);
  }
  p.mode = options.mode;
  p.dilation = view.planes[2];
  p.compensated_from = view.planes[3];
  p.projected = projected.data();
  p.gradients = gradients.data();
  p.visible = visible.data();
  p.visible_counts = visible_counts.data();
  p.mean_gradients = means.data();
  p.log_scale_gradients = log_scales.data();
  p.quat_gradients = quats.data();
  p.opacity_logit_gradients = opacity_logits.data();
  p.means2d = means2d.data();
  for (int64_t chunk = 0; chunk < ProjectChunks(p.count); ++chunk) ProjectBackwardCpu(p, chunk);
  for (size_t k = 0; k < n; ++k) {
    const auto write = [&](const GpuMemory& memory, const Buffer<float>& column, size_t width) {
      const auto to = static_cast<uint64_t>(rows[k] - gradient.first) * 4 * width;
      r.device->Write(*memory, to, std::as_bytes(std::span(column.data() + width * k, width)));
    };
    write(gradient.means, means, 3);
    write(gradient.log_scales, log_scales, 3);
    write(gradient.quats, quats, 4);
    write(gradient.opacity_logits, opacity_logits, 1);
    write(gradient.means2d, means2d, 2);
  }
  return {};
}

}  // namespace anchorsplat

#pragma once

#include <cstdint>
#include <type_traits>

namespace anchorsplat {

// Structs shared by kernels and host, laid out as in WGSL; render/view.wgsl describes their members.

struct GpuView {
  float r[3][4], r_low[3][4];
  float center[4], center_low[4];
  float f[4], f_low[4];
  float background[4];
  uint32_t size[4], counts[4];
  float planes[4], cuts[4];
  uint32_t flags[4];
};
static_assert(sizeof(GpuView) == 256 && std::is_trivially_copyable_v<GpuView>);

struct GpuSeen {
  float at[2], at_low[2];
  float depth, log2_opacity, compensation;
  uint32_t spare;
  float u[3], spare_u;
  float rgb[3], spare_rgb;
};
static_assert(sizeof(GpuSeen) == 64 && std::is_trivially_copyable_v<GpuSeen>);

// Buffers of a picture with N Gaussians, T = tiles_x·tiles_y tiles and P pixels:
//   seen     Seen[N]     undefined for culled Gaussians
//   rects    vec2u[N]    tiles of a Gaussian, half-open: x0 | y0 << 16, x1 | y1 << 16; (0, 0) = culled
//   radii    vec2i[N]    px, as the profile defines them; 0 = culled by its rules
//   order    u32[M]      rows of the visible Gaussians by depth
//   sizes    u32[16]     see GpuSize
//   ranges   u32[R+1]    for a run of R tiles: first pair of each tile within the run, and the number of pairs
//   pairs    u32[…]      rows, by tile and depth
//   picture  f32[5,P]    red, green, blue, alpha, expected depth (0 unless requested), planar
//   kept     vec2u[P]    bits of T; 1 + index in the tile's list of the last Gaussian added, 0 for none
enum GpuSize : uint32_t {
  kSizeVisible = 0,    // M
  kSizePairs = 1,      // of the listed run
  kSizeGaussians = 2,  // N
};

// Mode of render/bin.wgsl.
enum class GpuBinStep : uint32_t { kCountTiles = 0, kCountPairs = 1, kListPairs = 2 };

// Items per block of sorts and scans.
inline constexpr uint32_t kGpuBlock = 2048;

}  // namespace anchorsplat

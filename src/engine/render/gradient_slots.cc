#include "render/gradient_slots.h"

#include <algorithm>

#include "core/parallel.h"
#include "render/project.h"

namespace anchorsplat {

namespace {

int64_t TilesOfRun(const SlotsParams& p, const TileRect& rect) {
  return TilesBefore(rect, p.last_tile, p.tiles_x) - TilesBefore(rect, p.first_tile, p.tiles_x);
}

}  // namespace

int64_t TilesBefore(const TileRect& rect, int64_t tile, int tiles_x) {
  const int64_t y = tile / tiles_x, x = tile % tiles_x, across = rect.x1 - rect.x0;
  if (y < rect.y0) return 0;
  if (y >= rect.y1) return across * (rect.y1 - rect.y0);
  return across * (y - rect.y0) + std::clamp<int64_t>(x - rect.x0, 0, across);
}

int64_t PlaceSlots(SlotsParams& p, int64_t max_slots, int64_t* starts) {
  const int64_t chunks = ProjectChunks(p.count);
  for (;;) {
    ParallelFor(0, chunks, 4, [&](int64_t first, int64_t last) {
      for (int64_t chunk = first; chunk < last; ++chunk) {
        const int32_t* rows = p.visible + chunk * kProjectChunk;
        int64_t slots = 0;
        for (int32_t k = 0; k < p.visible_counts[chunk]; ++k) {
          const TileRect& rect = p.tiles[rows[k]];
          p.projected[rows[k]].slot = static_cast<int32_t>(slots - TilesBefore(rect, p.first_tile, p.tiles_x));
          slots += TilesOfRun(p, rect);
        }
        starts[chunk] = slots;
      }
    });
    int64_t slots = 0;
    for (int64_t chunk = 0; chunk < chunks; ++chunk) {
      const int64_t own = starts[chunk];
      starts[chunk] = slots;
      slots += own;
    }
    if (slots <= max_slots || p.last_tile == p.first_tile + 1) return slots;
    p.last_tile = p.first_tile + std::max<int64_t>(1, (p.last_tile - p.first_tile) / 2);
  }
}

void SumSlots(const SlotsParams& p, const GradientSlots& slots, int64_t chunk, bool first_run, BlendGradient* gradients,
              float* absolute) {
  const int32_t* rows = p.visible + chunk * kProjectChunk;
  const int32_t visible = p.visible_counts[chunk];
  const int64_t start = slots.starts[chunk];
  const bool all_tiles = p.covers_all();
  for (int32_t k = 0; k < visible; ++k) {
    const int64_t i = rows[k];
    const TileRect rect = p.tiles[i];
    int64_t begin = start + p.projected[i].slot, size = int64_t{rect.x1 - rect.x0} * (rect.y1 - rect.y0);
    if (!all_tiles) {
      begin += TilesBefore(rect, p.first_tile, p.tiles_x);
      size = TilesOfRun(p, rect);
    }
    BlendGradient sum = first_run ? BlendGradient{} : gradients[i];
    for (int64_t slot = begin; slot < begin + size; ++slot) {
      if (slots.touched[slot] != 0) sum += slots.sums[slot];
    }
    gradients[i] = sum;
    if (absolute == nullptr) continue;
    for (int64_t a = 0; a < 2; ++a) {
      float total = first_run ? 0 : absolute[2 * i + a];
      for (int64_t slot = begin; slot < begin + size; ++slot) {
        if (slots.touched[slot] != 0) total += slots.absolute[2 * slot + a];
      }
      absolute[2 * i + a] = total;
    }
  }
}

}  // namespace anchorsplat

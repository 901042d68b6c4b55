#include "formats/ply/color_range.h"

#include <cmath>
#include <cstdint>

#include "core/log.h"
#include "core/text.h"

namespace anchorsplat {

float FullIntensityOf(std::span<const float> colors) {
  constexpr float kBeyondLight = 16, kBeyondBytes = 512;
  constexpr int64_t kShare = 100;  // 1 of 100 is enough
  int64_t lit = 0, beyond_one = 0, beyond_light = 0, beyond_bytes = 0, broken = 0;
  for (const float color : colors) {
    if (!std::isfinite(color) || color <= 0) continue;
    ++lit;
    beyond_one += color > 1 ? 1 : 0;
    beyond_light += color > kBeyondLight ? 1 : 0;
    beyond_bytes += color > kBeyondBytes ? 1 : 0;
    broken += color != std::floor(color) ? 1 : 0;
  }
  const bool is_one = 2 * beyond_one <= lit && kShare * beyond_light <= lit && (broken > 0 || beyond_one == 0);
  if (is_one) return 1;
  return kShare * beyond_bytes > lit ? 65535.0f : 255.0f;
}

void FindFullColor(const InputFile& file, const GaussianCloud& rows, PlyLayout& layout, ExtraProperties* extras) {
  if (layout.float_color) layout.full_color = FullIntensityOf(rows.sh);  // degree 0, as there is no f_rest
  if (extras != nullptr) extras->full_color = layout.full_color;
  if (!layout.float_color || layout.full_color == 1) return;
  LogInfo(Cat(file.name(), ": its red green blue are floats above 1, so they are read as colours from 0 to ",
              std::lround(layout.full_color), "; convert --colors 0-1 reads them as they are"));
}

}  // namespace anchorsplat

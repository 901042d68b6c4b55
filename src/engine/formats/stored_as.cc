#include "formats/stored_as.h"

#include "core/log.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "core/stored_values.h"
#include "core/text.h"
#include "formats/number_or_nan.h"

namespace anchorsplat {

void ConvertToStored(GaussianCloud& cloud, const StoredAs& stored, float full_color) {
  if (stored == StoredAs{}) return;
  const bool colors = stored.max_color > 0 && stored.max_color != full_color;
  ParallelFor(0, cloud.size(), 1 << 14, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      for (int64_t k = 3 * i; stored.lengths && k < 3 * i + 3; ++k) {
        float& scale = cloud.log_scales[static_cast<size_t>(k)];
        scale = LogFromStoredScale(scale);
      }
      float& opacity = cloud.opacity_logits[static_cast<size_t>(i)];
      if (stored.opacities) opacity = LogitFromStoredOpacity(opacity);
      float* const sh = cloud.sh.data() + i * cloud.sh_stride();
      for (int k = 0; colors && k < 3; ++k) {
        const float color = full_color > 0 ? ColorFromDc(sh[k]) * full_color : sh[k];
        sh[k] = DcFromColor(color / stored.max_color);
      }
    }
  });
}

void WarnOfStored(const std::string& name, const CloudView& cloud, const StoredAs& told) {
  const StoredSample sample = SampleStored(cloud);
  const auto warn = [&name](const char* what, const char* option) {
    LogWarning(Cat(name, ": its ", what, "; if so, read it with ", option));
  };
  if (!told.lengths && LooksLikeLengths(sample)) warn("scales look like lengths, not logarithms", "--scales lengths");
  if (!told.opacities && LooksLikeOpacities(sample)) warn("opacities look like 0 to 1, not logits", "--opacities 0-1");
  if (told.max_color > 0) return;
  const int colors = LooksLikeColors(sample);
  if (colors == 1) warn("f_dc look like colours from 0 to 1, not harmonics", "--colors 0-1");
  if (colors == 255) warn("f_dc look like colours from 0 to 255, not harmonics", "--colors 0-255");
}

}  // namespace anchorsplat

#include "edit/row_source.h"

#include "core/parallel.h"

namespace anchorsplat {

CloudView RowsOf(const CloudView& cloud, int64_t first, int64_t last) {
  const auto begin = static_cast<size_t>(first), count = static_cast<size_t>(last - first);
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  CloudView rows = cloud;
  rows.means = cloud.means.subspan(3 * begin, 3 * count);
  rows.log_scales = cloud.log_scales.subspan(3 * begin, 3 * count);
  rows.quats = cloud.quats.subspan(4 * begin, 4 * count);
  rows.opacity_logits = cloud.opacity_logits.subspan(begin, count);
  rows.sh = cloud.sh.subspan(stride * begin, stride * count);
  return rows;
}

Status MemoryRows::Show(int64_t first, int64_t last, const Look& look) {
  look({first, RowsOf(cloud_, first, last), &extras_, first});
  return {};
}

Status MemoryRows::ForEach(const Look& look) {
  ParallelFor(0, size(), kRowsPerBlock, [&](int64_t first, int64_t last) { (void)Show(first, last, look); });
  return {};
}

}  // namespace anchorsplat

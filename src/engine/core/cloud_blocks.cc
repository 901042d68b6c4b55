#include "core/cloud_blocks.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/parallel.h"
#include "core/run_context.h"
#include "core/statistics.h"

namespace anchorsplat {

MemoryBlocks::MemoryBlocks(const CloudView& cloud) : cloud_(cloud) {
  size_ = cloud.size();
  sh_degree_ = cloud.sh_degree;
  render_mode_ = cloud.render_mode;
  comments_.assign(cloud.comments.begin(), cloud.comments.end());
  origin_ = cloud.origin;
}

MemoryBlocks::MemoryBlocks(GaussianCloud cloud) : MemoryBlocks(CloudView()) {
  owned_ = std::move(cloud);
  cloud_ = CloudView(owned_);
  size_ = cloud_.size();
  sh_degree_ = cloud_.sh_degree;
  render_mode_ = owned_.render_mode;
  comments_ = owned_.comments;
  origin_ = owned_.origin;
}

Status MemoryBlocks::ForEach(const Visitor& visit) {
  if (!usable_known_) usable_.resize(static_cast<size_t>(size_));
  ParallelFor(0, size_, kCloudBlockRows, [&](int64_t first, int64_t last) {
    const auto begin = static_cast<size_t>(first), rows = static_cast<size_t>(last - first);
    if (!usable_known_) {
      for (int64_t i = first; i < last; ++i) usable_[static_cast<size_t>(i)] = IsUsable(cloud_, i) ? 1 : 0;
    }
    Buffer<float> colors(3 * rows);
    const float* from = cloud_.sh.data() + first * cloud_.sh_stride();
    for (size_t k = 0; k < rows; ++k, from += cloud_.sh_stride()) std::copy_n(from, 3, colors.data() + 3 * k);
    CloudBlock block;
    block.first = first;
    block.rows.means = cloud_.means.subspan(3 * begin, 3 * rows);
    block.rows.log_scales = cloud_.log_scales.subspan(3 * begin, 3 * rows);
    block.rows.quats = cloud_.quats.subspan(4 * begin, 4 * rows);
    block.rows.opacity_logits = cloud_.opacity_logits.subspan(begin, rows);
    block.rows.sh = colors;
    block.usable = std::span<const uint8_t>(usable_).subspan(begin, rows);
    visit(block);
  });
  usable_known_ = true;
  return {};
}

Status Study(CloudBlocks& blocks, std::span<RowStudy* const> studies) {
  for (;;) {
    LeaveIfAbandoned();
    std::vector<RowStudy*> left;
    std::ranges::copy_if(studies, std::back_inserter(left), [](const RowStudy* study) { return !study->done(); });
    if (left.empty()) return {};
    ANCHORSPLAT_RETURN_IF_ERROR(blocks.ForEach([&](const CloudBlock& block) {
      for (RowStudy* const study : left) study->Visit(block);
    }));
    for (RowStudy* const study : left) study->EndPass();
  }
}

}  // namespace anchorsplat

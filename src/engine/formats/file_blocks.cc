#include "formats/file_blocks.h"

#include <algorithm>

#include "core/parallel.h"
#include "core/statistics.h"
#include "formats/first_failure.h"

namespace anchorsplat {

void FileBlocks::BeginPass() {
  if (first_time()) usable_.assign(static_cast<size_t>(size_), 1);
}

Status FileBlocks::VisitRows(int64_t first, int64_t last, Scratch& scratch, const Visitor& visit) {
  for (int64_t i = first; i < last; i += kCloudBlockRows) {
    const int64_t end = std::min(last, i + kCloudBlockRows);
    const auto usable = std::span(usable_).subspan(static_cast<size_t>(i), static_cast<size_t>(end - i));
    scratch.rows.Resize(end - i, 0);
    ANCHORSPLAT_RETURN_IF_ERROR(Fill(i, end, scratch, first_time() ? usable : std::span<uint8_t>()));
    if (first_time()) {
      for (int64_t k = 0; k < end - i; ++k) {
        uint8_t& one = usable[static_cast<size_t>(k)];
        one = one != 0 && IsUsable(scratch.rows, k) ? 1 : 0;
      }
    }
    CloudBlock block;
    block.first = i;
    block.rows = scratch.rows;
    block.usable = usable;
    visit(block);
  }
  return {};
}

Status FileBlocks::EndPass() {
  if (!first_time()) return {};
  ANCHORSPLAT_RETURN_IF_ERROR(EndFirstPass());
  usable_known_ = true;
  return {};
}

Status FileBlocks::ForEach(const Visitor& visit) {
  BeginPass();
  FirstFailure failure;
  ParallelFor(0, size_, kRowsPerScratch, [&](int64_t first, int64_t last) {
    Scratch scratch;
    failure.Report(first, VisitRows(first, last, scratch, visit));
  });
  ANCHORSPLAT_RETURN_IF_ERROR(failure.status());
  return EndPass();
}

}  // namespace anchorsplat

#include "formats/ply/ply_blocks.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/statistics.h"
#include "formats/first_failure.h"
#include "formats/ply/ply_body.h"
#include "formats/ply/ply_filter.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/ply_layout.h"

namespace anchorsplat {

namespace {

constexpr size_t kReadAtOnce = size_t{128} << 10;  // bytes: stay in the L2 cache with what becomes of them

// Whether one of `count` floats is infinite or NaN: its exponent is all ones, to which one more is added here so that
// the sign bit tells. `from` has any alignment.
bool HasNotFinite(const char* from, size_t count) {
  uint32_t carry = 0;
  for (size_t k = 0; k < count; ++k) {
    uint32_t bits;
    std::memcpy(&bits, from + k * sizeof bits, sizeof bits);
    carry |= (bits & 0x7fffffffu) + 0x00800000u;
  }
  return (carry >> 31) != 0;
}

class PlyBlocks final : public CloudBlocks {
 public:
  PlyBlocks(const InputFile& file, PlyHeader header, const PlyLayout& layout, uint64_t begin)
      : file_(file),
        header_(std::move(header)),
        begin_(begin),
        row_size_(static_cast<size_t>(layout.vertex->row_size())) {
    size_ = layout.vertex->count;
    sh_degree_ = layout.sh_degree;
    render_mode_ = header_.render_mode;
    if (layout.filter && !render_mode_) render_mode_ = RenderMode::kMip;
    comments_ = header_.comments;
    size_t offset = 0;
    for (size_t p = 0; p < layout.targets.size(); ++p, offset += sizeof(float)) {
      if (layout.filter == p) filter_ = offset;
      if (!layout.targets[p]) {
        offset += static_cast<size_t>(PlyTypeSize(layout.vertex->properties[p].type)) - sizeof(float);
        continue;
      }
      const PlyTarget& target = *layout.targets[p];
      if (target.array != &GaussianCloud::sh) {
        columns_.push_back({offset, target.array, target.width, target.component});
      } else if (target.component < 3) {
        columns_.push_back({offset, target.array, 3, target.component});
      } else if (!harmonics_.empty() && harmonics_.back().offset + harmonics_.back().count * sizeof(float) == offset) {
        ++harmonics_.back().count;
      } else {
        harmonics_.push_back({offset, 1});
      }
    }
  }

  Status ForEach(const Look& look) override {
    if (!usable_known_) usable_.resize(static_cast<size_t>(size_));
    FirstFailure failure;
    ParallelFor(0, size_, 4 * kCloudBlockRows, [&](int64_t first, int64_t last) {
      Room room;
      for (int64_t i = first; i < last; i += kCloudBlockRows) {
        const Status status = Fill(i, std::min(last, i + kCloudBlockRows), room);
        if (!status.ok()) return failure.Report(i, status);
        CloudBlock block;
        block.first = i;
        block.rows = room.rows;
        block.usable =
            std::span<const uint8_t>(usable_).subspan(static_cast<size_t>(i), room.rows.opacity_logits.size());
        look(block);
      }
    });
    ANCHORSPLAT_RETURN_IF_ERROR(failure.status());
    if (usable_known_) return {};
    usable_known_ = true;
    WarnOfOddTags(file_, header_);
    if (filter_) SayFilterIsFused(file_, *render_mode_);
    return {};
  }

 private:
  struct Column {
    size_t offset;  // bytes from the row's begin
    Buffer<float> GaussianCloud::*array;
    int64_t width;
    int component;
  };
  struct Run {
    size_t offset;
    size_t count;  // floats one behind the other
  };
  struct Room {
    Buffer<char> bytes;
    GaussianCloud rows;
    Buffer<float> filter;
  };

  Status Fill(int64_t first, int64_t last, Room& room) {
    const int64_t at_once = std::max<int64_t>(1, static_cast<int64_t>(kReadAtOnce / row_size_));
    room.rows.Resize(last - first, 0);
    if (filter_) room.filter.resize(static_cast<size_t>(last - first));
    room.bytes.resize(static_cast<size_t>(std::min(at_once, last - first)) * row_size_);
    for (int64_t i = first; i < last; i += at_once) {
      const int64_t end = std::min(last, i + at_once);
      ANCHORSPLAT_RETURN_IF_ERROR(file_.ReadAt(begin_ + static_cast<uint64_t>(i) * row_size_, room.bytes.data(),
                                               static_cast<size_t>(end - i) * row_size_));
      Unpack(i, end, i - first, room);
    }
    if (filter_) {
      ANCHORSPLAT_RETURN_IF_ERROR(FuseFilter(file_, room.filter, first, room.rows));
    }
    if (usable_known_) return {};
    for (int64_t i = first; i < last; ++i) {
      uint8_t& usable = usable_[static_cast<size_t>(i)];
      usable = usable != 0 && IsUsable(room.rows, i - first) ? 1 : 0;
    }
    return {};
  }

  // Rows first to last of the file to row `to` of the room and on.
  void Unpack(int64_t first, int64_t last, int64_t to, Room& room) {
    for (const Column& column : columns_) {
      float* out = (room.rows.*column.array).data() + to * column.width + column.component;
      const char* from = room.bytes.data() + column.offset;
      for (int64_t i = first; i < last; ++i, from += row_size_, out += column.width)
        std::memcpy(out, from, sizeof *out);
    }
    if (filter_) {
      const char* from = room.bytes.data() + *filter_;
      for (int64_t i = first; i < last; ++i, from += row_size_) {
        std::memcpy(room.filter.data() + to + (i - first), from, sizeof(float));
      }
    }
    if (usable_known_) return;
    const char* row = room.bytes.data();
    for (int64_t i = first; i < last; ++i, row += row_size_) {
      bool finite = true;
      for (const Run& run : harmonics_) finite &= !HasNotFinite(row + run.offset, run.count);
      usable_[static_cast<size_t>(i)] = finite ? 1 : 0;
    }
  }

  const InputFile& file_;
  PlyHeader header_;
  uint64_t begin_;  // byte of the first row
  size_t row_size_;
  std::vector<Column> columns_;
  std::vector<Run> harmonics_;  // those that are no columns
  std::optional<size_t> filter_;
};

}  // namespace

Result<std::unique_ptr<CloudBlocks>> BlocksOfPly(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(PlyHeader header, ReadPlyHeader(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyLayout layout, PlanPly(file, header));
  const PlyElement& vertex = *layout.vertex;
  bool floats = header.encoding == PlyEncoding::kLittleEndian && std::endian::native == std::endian::little;
  for (size_t p = 0; p < layout.targets.size(); ++p) {
    const PlyProperty& property = vertex.properties[p];
    floats &= !property.list_count;
    if (layout.targets[p] || layout.filter == p) floats &= property.type == PlyType::kFloat;
  }
  if (!floats) return std::unique_ptr<CloudBlocks>();
  ANCHORSPLAT_RETURN_IF_ERROR(CheckGaussianLimit(file, vertex, limits));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const uint64_t begin, BeginOfPlyRows(file, header, vertex));
  return std::unique_ptr<CloudBlocks>(std::make_unique<PlyBlocks>(file, std::move(header), layout, begin));
}

}  // namespace anchorsplat

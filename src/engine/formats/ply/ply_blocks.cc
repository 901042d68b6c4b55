#include "formats/ply/ply_blocks.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "formats/file_blocks.h"
#include "formats/ply/ply_body.h"
#include "formats/ply/ply_color_space.h"
#include "formats/ply/ply_filter.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/ply_layout.h"

namespace anchorsplat {

namespace {

class PlyBlocks final : public FileBlocks {
 public:
  PlyBlocks(const InputFile& file, PlyHeader header, const PlyLayout& layout, uint64_t begin)
      : file_(file),
        header_(std::move(header)),
        layout_(layout),
        vertex_(*layout.vertex),
        begin_(begin),
        row_size_(static_cast<size_t>(layout.vertex->row_size())) {
    size_ = layout.vertex->count;
    sh_degree_ = layout.sh_degree;
    render_mode_ = header_.render_mode;
    if (layout.filter && !render_mode_) render_mode_ = RenderMode::kMip;
    comments_ = header_.comments;
    origin_ = header_.origin;
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

 private:
  struct Column {
    size_t offset;  // bytes from the row's begin
    Buffer<float> GaussianCloud::*array;
    int64_t width;
    int component;
  };
  struct Run {
    size_t offset;
    size_t count;  // consecutive floats
  };
  Status Fill(int64_t first, int64_t last, Scratch& scratch, std::span<uint8_t> finite) override {
    Buffer<float> filter(filter_ ? static_cast<size_t>(last - first) : 0);
    ANCHORSPLAT_RETURN_IF_ERROR(ReadRows(
        file_, begin_, row_size_, first, last, scratch.bytes, [&](const uint8_t* bytes, int64_t count, int64_t to) {
          Unpack(bytes, count, to, scratch.rows);
          for (int64_t i = 0; filter_ && i < count; ++i) {
            std::memcpy(filter.data() + to + i, bytes + *filter_ + static_cast<size_t>(i) * row_size_, sizeof(float));
          }
          if (finite.empty()) return;
          const uint8_t* row = bytes;
          for (int64_t i = to; i < to + count; ++i, row += row_size_) {
            bool all = true;
            for (const Run& run : harmonics_) all &= !HasNonFinite(row + run.offset, run.count);
            finite[static_cast<size_t>(i)] = all ? 1 : 0;
          }
        }));
    FinishPlyRows(layout_, scratch.rows);
    return filter_ ? FuseFilter(file_, filter, first, scratch.rows) : Status();
  }

  // Unpacks `count` rows of the file into rows from `to` on.
  void Unpack(const uint8_t* bytes, int64_t count, int64_t to, GaussianCloud& rows) const {
    for (const Column& column : columns_) {
      float* out = (rows.*column.array).data() + to * column.width + column.component;
      const uint8_t* from = bytes + column.offset;
      for (int64_t i = 0; i < count; ++i, from += row_size_, out += column.width) std::memcpy(out, from, sizeof *out);
    }
  }

  Status EndFirstPass() override {
    WarnOfPlyDegree(file_, layout_);
    WarnOfUnknownModeTags(file_, header_);
    WarnOfSurplus(file_, header_, vertex_);
    if (filter_) ReportFusedFilter(file_, *render_mode_);
    return {};
  }

  const InputFile& file_;
  PlyHeader header_;
  PlyLayout layout_;
  const PlyElement& vertex_;  // of header_; moving a vector keeps its elements in place
  uint64_t begin_;            // offset of the first row
  size_t row_size_;
  std::vector<Column> columns_;
  std::vector<Run> harmonics_;  // properties not stored in columns
  std::optional<size_t> filter_;
};

}  // namespace

Result<std::unique_ptr<CloudBlocks>> BlocksOfPly(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(PlyHeader header, ReadPlyHeader(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyLayout layout, PlanPly(file, header));
  const PlyElement& vertex = *layout.vertex;
  bool floats = layout.stored_as_read() && header.encoding == PlyEncoding::kLittleEndian &&
                std::endian::native == std::endian::little;
  for (size_t p = 0; p < layout.targets.size(); ++p) {
    const PlyProperty& property = vertex.properties[p];
    floats &= !property.list_count;
    if (layout.targets[p] || layout.filter == p) floats &= property.type == PlyType::kFloat;
  }
  if (!floats || header.Find(kColorSpace) != nullptr) return std::unique_ptr<CloudBlocks>();  // must be read whole
  ANCHORSPLAT_RETURN_IF_ERROR(CheckGaussianLimit(file, vertex, limits));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const uint64_t begin, BeginOfPlyRows(file, header, vertex));
  return std::unique_ptr<CloudBlocks>(std::make_unique<PlyBlocks>(file, std::move(header), layout, begin));
}

}  // namespace anchorsplat

#include "formats/ply/ply_input.h"

#include <utility>
#include <vector>

#include "formats/ply/ply_body.h"
#include "formats/ply/ply_color_space.h"
#include "formats/ply/ply_rows.h"

namespace anchorsplat {

Result<std::optional<PlyInput>> PlyInput::Open(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(PlyHeader header, ReadPlyHeader(file));
  PlyInput input(file, std::move(header));
  ANCHORSPLAT_ASSIGN_OR_RETURN(input.layout_, PlanPly(file, input.header_));
  const PlyLayout& layout = input.layout_;
  const PlyElement& vertex = *layout.vertex;
  if (input.header_.encoding == PlyEncoding::kAscii || vertex.has_lists() || HasDoubleMeans(layout) ||
      !layout.stored_as_read() || layout.filter || input.header_.Find(kColorSpace) != nullptr) {
    return std::optional<PlyInput>();
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckGaussianLimit(file, vertex, limits));
  ANCHORSPLAT_ASSIGN_OR_RETURN(input.begin_, BeginOfPlyRows(file, input.header_, vertex));
  input.count_ = vertex.count;
  input.head_.sh_degree = layout.sh_degree;
  input.head_.render_mode = input.header_.render_mode;
  input.head_.comments = input.header_.comments;
  input.head_.origin = input.header_.origin;
  PlyHeader one = input.header_;
  const auto at = static_cast<size_t>(&vertex - input.header_.elements.data());
  one.elements[at].count = 1;
  PlyLayout of_one = layout;
  of_one.vertex = &one.elements[at];
  input.extras_ = PlanExtras(one, of_one);
  input.has_normals_ = !input.extras_.normals.empty();
  input.extras_.rows.clear();
  input.extras_.normals.clear();
  return std::optional<PlyInput>(std::move(input));
}

Status PlyInput::Read(int64_t first, int64_t last, GaussianCloud& rows, ExtraProperties& extras) const {
  const int64_t count = last - first;
  if (rows.size() != count || rows.sh_degree != head_.sh_degree) rows.Resize(count, head_.sh_degree);
  if (extras.properties.size() != extras_.properties.size()) extras.properties = extras_.properties;
  extras.rows.resize(static_cast<size_t>(count) * extras_.row_size());
  extras.normals.assign(has_normals_ ? 3 * static_cast<size_t>(count) : 0, 0.0f);
  Buffer<double> world;
  Buffer<float> filter;
  const std::vector<PlyDestination> to = Destinations(layout_, rows, world, filter, &extras);
  ANCHORSPLAT_RETURN_IF_ERROR(ReadFixedRows(*file_, *layout_.vertex, header_.encoding, begin_, first, last, to));
  FinishPlyRows(layout_, rows);
  return {};
}

void PlyInput::Warn() const {
  WarnOfPlyDegree(*file_, layout_);
  WarnOfUnknownModeTags(*file_, header_);
  WarnOfSurplus(*file_, header_, *layout_.vertex);
}

}  // namespace anchorsplat

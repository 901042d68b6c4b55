#include "formats/ply/ply_reader.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/log.h"
#include "core/smoothing_filter.h"
#include "core/text.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/ply_layout.h"
#include "formats/ply/ply_rows.h"

namespace anchorsplat {

namespace {

std::string Thousands(uint64_t n) { return WithThousands(static_cast<int64_t>(n)); }

// `count` rows of at least `row_size` bytes must fit into `available` bytes: a header may promise anything, and what it
// promises becomes an allocation.
Status CheckPromise(const InputFile& file, const PlyElement& element, uint64_t row_size, uint64_t begin) {
  const uint64_t available = file.size() - begin;
  if (row_size == 0 || static_cast<uint64_t>(element.count) <= available / row_size) return {};
  return Error{ErrorCode::kBadFile,
               Cat(file.name(), ": byte ", Thousands(file.size()), ": the file ends too early: element \"",
                   Printable(element.name), "\" has ", WithThousands(element.count), " rows of ",
                   element.has_lists() ? "at least " : "", Thousands(row_size), " bytes, ", Thousands(available),
                   " bytes are left for them")};
}

// For as many Gaussians as the file is known to hold. What goes where.
std::vector<PlyDestination> MakeRoom(const PlyHeader& header, const PlyLayout& layout, GaussianCloud& cloud,
                                     Buffer<float>& filter, ExtraProperties* extras) {
  cloud.Resize(layout.vertex->count, layout.sh_degree);
  if (layout.filter) filter.resize(static_cast<size_t>(layout.vertex->count));
  if (extras != nullptr) *extras = PlanExtras(header, layout);
  return Destinations(layout, cloud, filter, extras);
}

Status ReadBinaryBody(const InputFile& file, const PlyHeader& header, const PlyLayout& layout, GaussianCloud& cloud,
                      Buffer<float>& filter, ExtraProperties* extras) {
  uint64_t begin = header.body;
  const PlyElement& vertex = *layout.vertex;
  for (const PlyElement& element : header.elements) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckPromise(file, element, element.row_size(), begin));
    if (&element == &vertex) break;
    if (element.has_lists()) {
      SequentialReader reader(file, begin);
      ANCHORSPLAT_RETURN_IF_ERROR(SkipRowsWithLists(reader, file, element, header.encoding));
      begin = reader.position();
    } else {
      begin += static_cast<uint64_t>(element.count) * element.row_size();
    }
  }
  const std::vector<PlyDestination> to = MakeRoom(header, layout, cloud, filter, extras);
  if (!vertex.has_lists()) return ReadFixedRows(file, vertex, header.encoding, begin, to);
  SequentialReader reader(file, begin);
  return ReadRowsWithLists(reader, file, vertex, header.encoding, to);
}

// Makes the smoothing filter a part of the Gaussians, as the "fused" file of Mip-Splatting's program has it: every
// program draws those, none but its own knows the property. What trains so is drawn with compensated opacity.
Status FuseFilter(const InputFile& file, const Buffer<float>& filter, GaussianCloud& cloud) {
  for (size_t i = 0; i < filter.size(); ++i) {
    if (filter[i] >= 0 && std::isfinite(filter[i])) continue;
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": row ", WithThousands(static_cast<int64_t>(i) + 1), ": property \"", kFilter3d,
                     "\" is ", filter[i], " (expected the size of Mip-Splatting's 3-D filter, 0 or more)")};
  }
  Smooth(cloud, filter, cloud.log_scales.data(), cloud.opacity_logits.data());
  if (!cloud.render_mode) cloud.render_mode = RenderMode::kMip;
  LogInfo(Cat(file.name(), ": Mip-Splatting's 3-D filter (", kFilter3d,
              ") is made a part of scales and opacities; the render mode is ", NameOf(*cloud.render_mode)));
  return {};
}

Result<GaussianCloud> Read(const InputFile& file, const ReadLimits& limits, ExtraProperties* extras) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(PlyHeader header, ReadPlyHeader(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyLayout layout, PlanPly(file, header));
  const PlyElement& vertex = *layout.vertex;
  if (vertex.count > limits.max_gaussians) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": line ", vertex.line, ": has ", WithThousands(vertex.count),
                                          " Gaussians, more than the limit of ", WithThousands(limits.max_gaussians))};
  }
  GaussianCloud cloud;
  Buffer<float> filter;
  if (header.encoding == PlyEncoding::kAscii) {
    // A value is at least one digit and a blank; the very last line end may be missing.
    if ((file.size() - header.body + 1) / 2 / vertex.properties.size() < static_cast<uint64_t>(vertex.count)) {
      return CheckPromise(file, vertex, 2 * vertex.properties.size(), header.body).error();
    }
    ANCHORSPLAT_RETURN_IF_ERROR(ReadAsciiBody(file, header, vertex, MakeRoom(header, layout, cloud, filter, extras)));
  } else {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadBinaryBody(file, header, layout, cloud, filter, extras));
  }
  // Trainers write normals of zero: there is nothing in them to keep.
  if (extras != nullptr && std::ranges::all_of(extras->normals, [](float x) { return x == 0; })) {
    extras->normals = {};
  }
  WarnOfOddTags(file, header);
  cloud.render_mode = header.render_mode;
  cloud.comments = std::move(header.comments);
  if (layout.filter) ANCHORSPLAT_RETURN_IF_ERROR(FuseFilter(file, filter, cloud));
  return cloud;
}

}  // namespace

Result<GaussianCloud> ReadPly(const InputFile& file, const ReadLimits& limits) { return Read(file, limits, nullptr); }

Result<GaussianCloud> ReadPlyWithExtras(const InputFile& file, const ReadLimits& limits, ExtraProperties& extras) {
  return Read(file, limits, &extras);
}

Result<FormatFacts> DescribePly(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyLayout layout, PlanPly(file, header));
  FormatFacts facts;
  facts.Add("encoding", header.encoding == PlyEncoding::kAscii          ? "text"
                        : header.encoding == PlyEncoding::kLittleEndian ? "binary, little-endian"
                                                                        : "binary, big-endian");
  std::string others;
  for (size_t k = 0; k < layout.targets.size(); ++k) {
    if (!layout.targets[k] && layout.filter != k)
      others += (others.empty() ? "" : " ") + layout.vertex->properties[k].name;
  }
  for (const PlyElement& element : header.elements) {
    if (&element != layout.vertex) others += Cat(others.empty() ? "" : " ", "(element ", element.name, ")");
  }
  if (layout.filter) facts.Add("3-D filter", "of Mip-Splatting (", kFilter3d, "), made a part of the Gaussians");
  if (!others.empty()) facts.Add("other properties", Printable(others, 200));
  return facts;
}

}  // namespace anchorsplat

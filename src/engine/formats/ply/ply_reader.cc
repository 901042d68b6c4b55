#include "formats/ply/ply_reader.h"

#include <algorithm>
#include <vector>

#include "core/log.h"
#include "core/text.h"
#include "formats/linear_color.h"
#include "formats/means_from_world.h"
#include "formats/ply/color_range.h"
#include "formats/ply/ply_body.h"
#include "formats/ply/ply_color_space.h"
#include "formats/ply/ply_filter.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/ply_layout.h"

namespace anchorsplat {

namespace {

// Destinations, allocated for the number of Gaussians that the file is known to hold.
std::vector<PlyDestination> MakeRoom(const PlyHeader& header, const PlyLayout& layout, GaussianCloud& cloud,
                                     Buffer<double>& world, Buffer<float>& filter, ExtraProperties* extras) {
  cloud.Resize(layout.vertex->count, layout.sh_degree);
  // Text may have any number of digits, whatever type the header states.
  if (header.encoding == PlyEncoding::kAscii || HasDoubleMeans(layout)) world.resize(cloud.means.size());
  if (layout.filter) filter.resize(static_cast<size_t>(layout.vertex->count));
  if (extras != nullptr) *extras = PlanExtras(header, layout);
  return Destinations(layout, cloud, world, filter, extras);
}

Result<GaussianCloud> Read(const InputFile& file, const ReadLimits& limits, ExtraProperties* extras) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(PlyHeader header, ReadPlyHeader(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(PlyLayout layout, PlanPly(file, header));
  const PlyElement& vertex = *layout.vertex;
  ANCHORSPLAT_RETURN_IF_ERROR(CheckGaussianLimit(file, vertex, limits));
  GaussianCloud cloud;
  Buffer<double> world;
  Buffer<float> filter;
  ANCHORSPLAT_RETURN_IF_ERROR(
      ReadPlyBody(file, header, vertex, [&] { return MakeRoom(header, layout, cloud, world, filter, extras); }));
  FindFullColor(file, cloud, layout, extras);
  FinishPlyRows(layout, cloud);
  cloud.origin = header.origin;
  if (!world.empty()) MeansFromWorld(file.name(), world, cloud);
  cloud.double_means = HasDoubleMeans(layout);
  if (extras != nullptr && cloud.double_means && IsZero(header.origin)) extras->world = std::move(world);
  // Trainers write zero normals, which need not be kept.
  if (extras != nullptr && std::ranges::all_of(extras->normals, [](float x) { return x == 0; })) {
    extras->normals = {};
  }
  WarnOfPlyDegree(file, layout);
  WarnOfUnknownModeTags(file, header);
  WarnOfSurplus(file, header, vertex);
  cloud.render_mode = header.render_mode;
  cloud.comments = std::move(header.comments);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const bool linear, HasLinearColors(file, header));
  if (linear) {
    LogWarning(Cat(file.name(), ": ", LinearColorInWords(cloud.sh_degree)));
    SrgbFromLinear(cloud, 0, cloud.size());
    if (extras != nullptr) std::erase(extras->not_kept, Cat("element \"", kColorSpace, "\""));
  }
  if (layout.filter) {
    ANCHORSPLAT_RETURN_IF_ERROR(FuseFilter(file, filter, 0, cloud));
    if (!cloud.render_mode) cloud.render_mode = RenderMode::kMip;
    ReportFusedFilter(file, *cloud.render_mode);
  }
  return cloud;
}

}  // namespace

Result<GaussianCloud> ReadPly(const InputFile& file, const ReadLimits& limits) { return Read(file, limits, nullptr); }

Result<GaussianCloud> ReadPlyWithExtras(const InputFile& file, const ReadLimits& limits, ExtraProperties& extras) {
  return Read(file, limits, &extras);
}

Result<CloudExtent> ExtentOfPly(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyLayout layout, PlanPly(file, header));
  const PlyElement& vertex = *layout.vertex;
  const uint64_t row = header.encoding == PlyEncoding::kAscii ? 2 * vertex.properties.size() : vertex.row_size();
  if (static_cast<uint64_t>(vertex.count) > file.size() / std::max<uint64_t>(1, row)) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": line ", vertex.line, ": the file is too short for ",
                                          WithThousands(vertex.count), " Gaussians")};
  }
  return CloudExtent{vertex.count, layout.sh_degree};
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
    if (!layout.targets[k] && layout.filter != k && !layout.dropped[k])
      others += (others.empty() ? "" : " ") + layout.vertex->properties[k].name;
  }
  if (HasDoubleMeans(layout)) facts.Add("positions", "in double precision");
  for (const PlyElement& element : header.elements) {
    if (&element != layout.vertex) others += Cat(others.empty() ? "" : " ", "(element ", element.name, ")");
  }
  if (layout.surfels) facts.Add("surfels", "of 2DGS (two scales), flat along their third axis");
  if (layout.full_color > 0) facts.Add("colours", "red green blue, in place of f_dc_*");
  if (layout.full_alpha > 0) facts.Add("opacities", "alpha, in place of opacity");
  if (layout.prefixed) facts.Add("names", "with CloudCompare's prefix \"scalar_\"");
  if (layout.has_degree_4()) facts.Add("harmonics", "degree 4, read as 3");
  if (layout.filter) facts.Add("3-D filter", "of Mip-Splatting (", kFilter3d, "), applied to the Gaussians");
  if (header.Find(kColorSpace) != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const bool linear, HasLinearColors(file, header));
    facts.Add("colour space", linear ? "linear RGB, converted to sRGB" : "sRGB");
  }
  if (!others.empty()) facts.Add("other properties", Printable(others, 200));
  return facts;
}

}  // namespace anchorsplat

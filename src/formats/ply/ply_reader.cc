#include "formats/ply/ply_reader.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/log.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "core/text.h"
#include "formats/linear_color.h"
#include "formats/ply/color_range.h"
#include "formats/ply/ply_body.h"
#include "formats/ply/ply_color_space.h"
#include "formats/ply/ply_filter.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/ply_layout.h"

namespace anchorsplat {

namespace {

// For as many Gaussians as the file is known to hold. What goes where.
std::vector<PlyDestination> MakeRoom(const PlyHeader& header, const PlyLayout& layout, GaussianCloud& cloud,
                                     Buffer<double>& world, Buffer<float>& filter, ExtraProperties* extras) {
  cloud.Resize(layout.vertex->count, layout.sh_degree);
  // Text has as many digits as its writer liked, whatever the header says.
  if (header.encoding == PlyEncoding::kAscii || HasDoubleMeans(layout)) world.resize(cloud.means.size());
  if (layout.filter) filter.resize(static_cast<size_t>(layout.vertex->count));
  if (extras != nullptr) *extras = PlanExtras(header, layout);
  return Destinations(layout, cloud, world, filter, extras);
}

// Half of the Gaussians are longer; of very many, of every so many. `sample` gets where these are.
double TypicalLength(const GaussianCloud& cloud, const Buffer<double>& world, std::vector<double>& sample) {
  constexpr int64_t kSamples = 1 << 16;
  const int64_t step = (cloud.size() + kSamples - 1) / kSamples;
  std::vector<float> lengths;
  for (int64_t i = 0; i < cloud.size(); i += step) {
    const float* s = cloud.log_scales.data() + 3 * i;
    const float longest = std::max({s[0], s[1], s[2]});
    if (std::isfinite(longest)) lengths.push_back(longest);
    sample.insert(sample.end(), world.data() + 3 * i, world.data() + 3 * i + 3);
  }
  return lengths.empty() ? 0 : std::exp(double{Quantile(lengths, 0.5)});
}

// Where Gaussians lie so far from each other that no origin makes floats fine enough for all. `said`: the file's own.
void WarnOfRounding(const InputFile& file, const Buffer<double>& world, const WorldOrigin& said,
                    const GaussianCloud& cloud) {
  constexpr double kSeen = 1.0 / 16;  // of a Gaussian's length
  int64_t count = 0;
  double most = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const std::array<double, 3> at = ToWorld(cloud.means.data() + 3 * i, cloud.origin);
    double off = 0;
    for (size_t k = 0; k < 3; ++k)
      off = std::max(off, std::fabs(at[k] - said[k] - world[3 * static_cast<size_t>(i) + k]));
    const float* s = cloud.log_scales.data() + 3 * i;
    if (!IsUsable(cloud, i) || !(off > kSeen * std::exp(double{std::max({s[0], s[1], s[2]})}))) continue;
    ++count;
    most = std::max(most, off);
  }
  if (count == 0) return;
  LogWarning(Cat(file.name(), ": positions of ", WithThousands(count), " of ", WithThousands(cloud.size()),
                 " Gaussians are rounded, by up to ", most,
                 ": they lie too far from the others for 32-bit floats. Split the file into parts that lie together"));
}

// Floats from an origin on, where floats need one.
void MeansFromWorld(const Buffer<double>& world, GaussianCloud& cloud) {
  std::vector<double> sample;
  const double length = TypicalLength(cloud, world, sample);
  const WorldOrigin origin = ChooseOrigin(sample, length);
  for (size_t k = 0; k < 3; ++k) cloud.origin[k] += origin[k];
  ParallelFor(0, cloud.size(), 1 << 14, [&](int64_t first, int64_t last) {
    for (int64_t i = 3 * first; i < 3 * last; ++i) {
      const auto at = static_cast<size_t>(i);
      cloud.means[at] = static_cast<float>(world[at] - origin[at % 3]);
    }
  });
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
  if (!world.empty()) MeansFromWorld(world, cloud);
  if (!world.empty()) WarnOfRounding(file, world, header.origin, cloud);
  cloud.double_means = HasDoubleMeans(layout);
  if (extras != nullptr && cloud.double_means && IsZero(header.origin)) extras->world = std::move(world);
  // Trainers write normals of zero: there is nothing in them to keep.
  if (extras != nullptr && std::ranges::all_of(extras->normals, [](float x) { return x == 0; })) {
    extras->normals = {};
  }
  WarnOfPlyDegree(file, layout);
  WarnOfOddTags(file, header);
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
    SayFilterIsFused(file, *cloud.render_mode);
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
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": line ", vertex.line, ": there are fewer bytes than ",
                                          WithThousands(vertex.count), " Gaussians take")};
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
  if (layout.prefixed) facts.Add("names", "behind CloudCompare's \"scalar_\"");
  if (layout.has_degree_4()) facts.Add("harmonics", "degree 4, read as 3");
  if (layout.filter) facts.Add("3-D filter", "of Mip-Splatting (", kFilter3d, "), made a part of the Gaussians");
  if (header.Find(kColorSpace) != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const bool linear, HasLinearColors(file, header));
    facts.Add("colour space", linear ? "linear RGB, made sRGB" : "sRGB");
  }
  if (!others.empty()) facts.Add("other properties", Printable(others, 200));
  return facts;
}

}  // namespace anchorsplat

#include "formats/ply/ply_writer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "core/parallel.h"
#include "core/text.h"
#include "formats/first_failure.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/render_mode_tag.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "rows are copied as they lie in memory");

// x y z nx ny nz, f_dc and f_rest, opacity scale rot
int64_t RowFloats(int sh_degree) { return 6 + 3 * ShCoefficients(sh_degree) + 8; }

// `comments`: header lines.
std::string Header(int64_t count, int sh_degree, bool double_means, const std::string& comments,
                   const ExtraProperties& extras) {
  std::string header = "ply\nformat binary_little_endian 1.0\n" + comments;
  header += Cat("element vertex ", count, "\n");
  const auto property = [&header](const auto&... name) { header += Cat("property float ", name..., "\n"); };
  for (const char* name : {"x", "y", "z"}) header += Cat("property ", double_means ? "double " : "float ", name, "\n");
  for (const char* name : {"nx", "ny", "nz"}) property(name);
  for (int k = 0; k < 3; ++k) property("f_dc_", k);
  for (int k = 0; k < 3 * (ShCoefficients(sh_degree) - 1); ++k) property("f_rest_", k);
  property("opacity");
  for (int k = 0; k < 3; ++k) property("scale_", k);
  for (int k = 0; k < 4; ++k) property("rot_", k);
  for (const auto& [name, type] : extras.properties) header += Cat("property ", PlyTypeName(type), " ", name, "\n");
  return header + "end_header\n";
}

// Bytes of a row.
size_t RowSize(int sh_degree, bool double_means, const ExtraProperties& extras) {
  const size_t wider = double_means ? 3 * (sizeof(double) - sizeof(float)) : 0;
  return static_cast<size_t>(RowFloats(sh_degree)) * sizeof(float) + wider + extras.row_size();
}

template <int kDegree>
void PackRows(const CloudView& cloud, int64_t first, int64_t last, float* out) {
  constexpr int kCoefficients = ShCoefficients(kDegree);
  const float* mean = cloud.means.data() + 3 * first;
  const float* scale = cloud.log_scales.data() + 3 * first;
  const float* quat = cloud.quats.data() + 4 * first;
  const float* sh = cloud.sh.data() + 3 * kCoefficients * first;
  for (int64_t i = first; i < last; ++i) {
    out = std::copy_n(mean, 3, out);
    out = std::fill_n(out, 3, 0.0f);
    out = std::copy_n(sh, 3, out);
    for (int channel = 0; channel < 3; ++channel) {
      for (int k = 1; k < kCoefficients; ++k) *out++ = sh[3 * k + channel];
    }
    *out++ = cloud.opacity_logits[static_cast<size_t>(i)];
    out = std::copy_n(scale, 3, out);
    out = std::copy_n(quat, 4, out);
    mean += 3, scale += 3, quat += 4, sh += 3 * kCoefficients;
  }
}

void Pack(const CloudView& cloud, int64_t first, int64_t last, float* out) {
  switch (cloud.sh_degree) {
    case 0:
      return PackRows<0>(cloud, first, last, out);
    case 1:
      return PackRows<1>(cloud, first, last, out);
    case 2:
      return PackRows<2>(cloud, first, last, out);
    default:
      return PackRows<3>(cloud, first, last, out);
  }
}

// Interleaves rows of `floats` values with those of `extras`, and writes means as doubles.
void PackExtras(const CloudView& cloud, const ExtraProperties& extras, int64_t first, int64_t last, float* rows,
                size_t floats, std::byte* wide) {
  constexpr size_t kMeans = 3;  // floats before the normals
  const size_t extra = extras.row_size();
  const size_t skipped = cloud.double_means ? kMeans : 0;
  const auto put = [&wide](const void* from, size_t bytes) {
    if (bytes > 0) std::memcpy(wide, from, bytes);
    wide += bytes;
  };
  for (int64_t i = first; i < last; ++i, rows += floats) {
    if (!extras.normals.empty()) std::copy_n(extras.normals.data() + 3 * i, 3, rows + kMeans);
    if (extra == 0 && skipped == 0) continue;
    if (skipped > 0) {
      const std::array<double, 3> at = ToWorld(rows, cloud.origin);
      put(extras.world.empty() ? at.data() : extras.world.data() + 3 * i, sizeof at);
    }
    put(rows + skipped, (floats - skipped) * sizeof(float));
    put(extras.rows.data() + static_cast<size_t>(i) * extra, extra);
  }
}

}  // namespace

uint64_t PredictedPlySize(int64_t count, int sh_degree, std::optional<RenderMode> render_mode,
                          std::span<const std::string> comments) {
  return Header(count, sh_degree, false, PlyComments(comments, render_mode, {}), {}).size() +
         static_cast<uint64_t>(count) * RowSize(sh_degree, false, {});
}

uint64_t ExtraPlyBytes(const CloudView& head, int64_t count, const ExtraProperties& extras) {
  const size_t more = RowSize(head.sh_degree, head.double_means, extras) - RowSize(head.sh_degree, false, {});
  return static_cast<uint64_t>(count) * more +
         (head.double_means ? 3 : 0);  // "double" is a letter longer than "float", for x, y and z
}

Status WritePly(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  return WritePlyWithExtras(path, cloud, options, {});
}

Result<PlyOutput> PlyOutput::Create(const std::filesystem::path& path, const CloudView& head, int64_t count,
                                    const CloudWriteOptions& options, const ExtraProperties& extras) {
  if (count == 0) return Error{ErrorCode::kBadArgument, Cat(path.string(), ": there are no Gaussians to write")};
  const std::string comments =
      PlyComments(head.comments, head.render_mode, head.double_means ? WorldOrigin{} : head.origin);
  const std::string header = Header(count, head.sh_degree, head.double_means, comments, extras);
  if (header.size() > kMaxPlyHeader) {
    return Error{ErrorCode::kBadArgument,
                 Cat(path.string(), ": comments and names of properties of ", HumanBytes(header.size()),
                     " do not fit a PLY header, which ends within ", HumanBytes(kMaxPlyHeader))};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  const size_t row_size = RowSize(head.sh_degree, head.double_means, extras);
  ANCHORSPLAT_RETURN_IF_ERROR(file.Reserve(header.size() + static_cast<uint64_t>(count) * row_size));
  ANCHORSPLAT_RETURN_IF_ERROR(file.WriteAt(0, header.data(), header.size()));
  return PlyOutput(std::move(file), header.size(), row_size);
}

Status PlyOutput::Write(const CloudView& cloud, const ExtraProperties& extras, int64_t first, int64_t last,
                        int64_t to) const {
  const auto floats = static_cast<size_t>(RowFloats(cloud.sh_degree));
  const bool wider = !extras.properties.empty() || cloud.double_means;
  // A block stays in the L2 cache between packing and writing.
  const auto block = static_cast<int64_t>(std::max<size_t>(1, (size_t{256} << 10) / row_size_));
  const auto most = static_cast<size_t>(std::min(block, last - first));
  Buffer<float> rows(most * floats);
  Buffer<std::byte> wide(wider ? most * row_size_ : 0);
  for (int64_t i = first; i < last; i += block) {
    const int64_t end = std::min(last, i + block);
    Pack(cloud, i, end, rows.data());
    if (wider || !extras.normals.empty()) PackExtras(cloud, extras, i, end, rows.data(), floats, wide.data());
    const void* const packed = wider ? static_cast<const void*>(wide.data()) : rows.data();
    ANCHORSPLAT_RETURN_IF_ERROR(file_.WriteAt(header_ + static_cast<uint64_t>(to + i - first) * row_size_, packed,
                                              static_cast<size_t>(static_cast<uint64_t>(end - i) * row_size_)));
  }
  return {};
}

Status WritePlyWithExtras(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options,
                          const ExtraProperties& extras) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  if (!extras.fits(cloud.size())) {
    return Error{ErrorCode::kBadArgument, Cat(path.string(), ": the extra properties (", extras.names(),
                                              ") do not match the ", WithThousands(cloud.size()), " Gaussians")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(PlyOutput file, PlyOutput::Create(path, cloud, cloud.size(), options, extras));
  const auto task = static_cast<int64_t>(std::max<size_t>(1, (size_t{4} << 20) / file.row_size()));
  FirstFailure failure;
  ParallelFor(0, cloud.size(), task, [&](int64_t first, int64_t last) {
    failure.Report(first, file.Write(cloud, extras, first, last, first));
  });
  ANCHORSPLAT_RETURN_IF_ERROR(failure.status());
  return file.Commit();
}

}  // namespace anchorsplat

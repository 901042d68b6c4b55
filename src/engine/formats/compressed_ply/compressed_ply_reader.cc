#include "formats/compressed_ply/compressed_ply_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/file_blocks.h"
#include "formats/first_failure.h"
#include "formats/ply/ply_header.h"
#include "formats/quantize.h"
#include "formats/record_blocks.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they lie in the file");

constexpr std::array<std::string_view, 18> kChunkProperties = {
    "min_x",       "min_y",       "min_z",       "max_x", "max_y", "max_z", "min_scale_x", "min_scale_y", "min_scale_z",
    "max_scale_x", "max_scale_y", "max_scale_z", "min_r", "min_g", "min_b", "max_r",       "max_g",       "max_b"};
constexpr size_t kRequiredChunkProperties = 12;
constexpr std::array<std::string_view, 4> kVertexProperties = {"packed_position", "packed_rotation", "packed_scale",
                                                               "packed_color"};

// min and max of x y z, of log-scales and of r g b, in the order of kChunkProperties.
struct ChunkRanges {
  float mean_min[3], mean_max[3], scale_min[3], scale_max[3], color_min[3], color_max[3];
};
static_assert(sizeof(ChunkRanges) == 18 * sizeof(float));

// An element with rows of fixed size, and its position.
struct Rows {
  const PlyElement* element = nullptr;
  uint64_t begin = 0;
};

Error BadHeader(const InputFile& file, const std::string& what) {
  return {ErrorCode::kBadFile, Cat(file.name(), ": is not a complete compressed PLY: ", what)};
}

// Byte of property `name` in a row, which must be of `type`.
Result<size_t> OffsetOf(const InputFile& file, const PlyElement& element, std::string_view name, PlyType type) {
  size_t offset = 0;
  for (const PlyProperty& property : element.properties) {
    if (property.name == name && property.type == type) return offset;
    offset += static_cast<size_t>(PlyTypeSize(property.type));
  }
  return BadHeader(file,
                   Cat("element \"", element.name, "\" has no property \"", name, "\" of type ", PlyTypeName(type)));
}

Result<Rows> Locate(const InputFile& file, const PlyHeader& header, std::string_view name) {
  uint64_t begin = header.body;
  for (const PlyElement& element : header.elements) {
    if (element.has_lists()) {
      return BadHeader(file, Cat("line ", element.line, ": element \"", Printable(element.name), "\" has lists"));
    }
    const uint64_t available = file.size() - begin;
    const uint64_t row_size = std::max<uint64_t>(1, element.row_size());
    if (static_cast<uint64_t>(element.count) > available / row_size) {
      return Error{ErrorCode::kBadFile, Cat(file.name(), ": byte ", WithThousands(static_cast<int64_t>(file.size())),
                                            ": the file ends too early: element \"", Printable(element.name), "\" has ",
                                            WithThousands(element.count), " rows of ", element.row_size(), " bytes")};
    }
    if (element.name == name) return Rows{&element, begin};
    begin += static_cast<uint64_t>(element.count) * element.row_size();
  }
  return Rows{};
}

// Degree from the SH element; 0 without one.
Result<int> HarmonicsDegree(const InputFile& file, const PlyElement* sh) {
  if (sh == nullptr) return 0;
  const auto rest = std::ranges::count_if(
      sh->properties, [](const PlyProperty& property) { return property.name.starts_with("f_rest_"); });
  for (int degree = 1; degree <= kMaxShDegree; ++degree) {
    if (rest == 3 * (ShCoefficients(degree) - 1)) return degree;
  }
  return BadHeader(file,
                   Cat("line ", sh->line, ": element \"sh\" has ", rest, " properties f_rest_*, expected 9, 24 or 45"));
}

Error WrongRange(const InputFile& file, int64_t chunk, size_t k, float min, float max) {
  return {ErrorCode::kBadFile,
          Cat(file.name(), ": chunk ", WithThousands(chunk), " has ", kChunkProperties[k], " ", min, " and ",
              kChunkProperties[k + 3], " ", max, ": the minimum is above the maximum")};
}

Result<std::vector<ChunkRanges>> ReadChunks(const InputFile& file, const Rows& rows) {
  const PlyElement& element = *rows.element;
  const bool has_colors = element.Find("min_r") != nullptr;
  std::array<size_t, kChunkProperties.size()> offsets{};
  for (size_t k = 0; k < (has_colors ? kChunkProperties.size() : kRequiredChunkProperties); ++k) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(offsets[k], OffsetOf(file, element, kChunkProperties[k], PlyType::kFloat));
  }
  std::vector<ChunkRanges> chunks(static_cast<size_t>(element.count));
  const auto row_size = static_cast<size_t>(element.row_size());
  FirstFailure wrong;
  ANCHORSPLAT_RETURN_IF_ERROR(
      ReadRecords(file, rows.begin, element.count, row_size, [&](int64_t first, int64_t last, const uint8_t* bytes) {
        for (int64_t i = first; i < last; ++i, bytes += row_size) {
          std::array<float, kChunkProperties.size()> values = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1};
          for (size_t k = 0; k < (has_colors ? values.size() : kRequiredChunkProperties); ++k) {
            std::memcpy(&values[k], bytes + offsets[k], sizeof(float));
          }
          for (const size_t k : {0u, 1u, 2u, 6u, 7u, 8u, 12u, 13u, 14u}) {
            if (values[k] > values[k + 3]) wrong.Report(i, WrongRange(file, i, k, values[k], values[k + 3]));
          }
          std::memcpy(&chunks[static_cast<size_t>(i)], values.data(), sizeof values);
        }
      }));
  ANCHORSPLAT_RETURN_IF_ERROR(wrong.status());
  return chunks;
}

// Weighted, not min + t·(max − min): both ends are exact.
float Mix(float min, float max, uint32_t value, uint32_t steps) {
  const float t = static_cast<float>(value) / static_cast<float>(steps);
  return min * (1 - t) + max * t;
}

void UnpackRanged(uint32_t packed, const float min[3], const float max[3], float out[3]) {
  out[0] = Mix(min[0], max[0], packed >> 21, 2047);
  out[1] = Mix(min[1], max[1], packed >> 11 & 1023, 1023);
  out[2] = Mix(min[2], max[2], packed & 2047, 2047);
}

void UnpackQuat(uint32_t packed, float quat[4]) {
  SmallestThree three;
  three.largest = packed >> 30;
  for (int k = 0; k < 3; ++k) {
    const uint32_t bits = packed >> (20 - 10 * k) & 1023;
    three.rest[k] = (static_cast<float>(bits) / 1023 - 0.5f) / kSqrtHalf;
  }
  RestoreLargest(three, quat);
}

// A file with its header and ranges read and checked.
struct OpenedCompressedPly {
  PlyHeader header;
  Rows vertices, harmonics;  // harmonics.element is null without SH
  int degree = 0;
  std::vector<ChunkRanges> chunks;
  std::array<size_t, 4> vertex_offsets{};   // of kVertexProperties
  std::vector<size_t> harmonics_offsets{};  // of f_rest_0 onwards

  int64_t count() const { return vertices.element->count; }
  size_t vertex_size() const { return static_cast<size_t>(vertices.element->row_size()); }
};

Result<OpenedCompressedPly> OpenCompressedPly(const InputFile& file, const ReadLimits& limits) {
  OpenedCompressedPly ply;
  ANCHORSPLAT_ASSIGN_OR_RETURN(ply.header, ReadPlyHeader(file));
  if (ply.header.encoding != PlyEncoding::kLittleEndian) return BadHeader(file, "it is not binary little-endian");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Rows chunk_rows, Locate(file, ply.header, "chunk"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ply.vertices, Locate(file, ply.header, "vertex"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ply.harmonics, Locate(file, ply.header, "sh"));
  for (const auto& [rows, name] : {std::pair(chunk_rows, "chunk"), std::pair(ply.vertices, "vertex")}) {
    if (rows.element == nullptr) return BadHeader(file, Cat("it has no element \"", name, "\""));
  }
  const int64_t count = ply.count();
  ANCHORSPLAT_RETURN_IF_ERROR(
      CheckCount(Cat(file.name(), ": line ", ply.vertices.element->line), static_cast<uint64_t>(count), limits));
  if (chunk_rows.element->count != (count + kCompressedPlyChunk - 1) / kCompressedPlyChunk) {
    return BadHeader(file, Cat("line ", chunk_rows.element->line, ": has ", WithThousands(chunk_rows.element->count),
                               " chunks for ", WithThousands(count), " Gaussians, expected one for 256"));
  }
  const PlyElement* const sh = ply.harmonics.element;
  if (sh != nullptr && sh->count != count) {
    return BadHeader(file, Cat("line ", sh->line, ": has ", WithThousands(sh->count), " rows of \"sh\" for ",
                               WithThousands(count), " Gaussians"));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(ply.degree, HarmonicsDegree(file, sh));
  // Empty rows would allow any count.
  for (size_t k = 0; k < kVertexProperties.size(); ++k) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(ply.vertex_offsets[k],
                                 OffsetOf(file, *ply.vertices.element, kVertexProperties[k], PlyType::kUint32));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(ply.chunks, ReadChunks(file, chunk_rows));
  for (int k = 0; k < 3 * (ShCoefficients(ply.degree) - 1); ++k) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t offset, OffsetOf(file, *sh, Cat("f_rest_", k), PlyType::kUint8));
    ply.harmonics_offsets.push_back(offset);
  }
  return ply;
}

// Reads rows of the file from `first` on into rows of the cloud from `to` on.
void UnpackVertices(const OpenedCompressedPly& ply, const uint8_t* bytes, int64_t first, int64_t count, int64_t to,
                    GaussianCloud& cloud) {
  static const std::array<float, 256> kLogits = [] {
    std::array<float, 256> logits{};
    for (size_t k = 0; k < 256; ++k) logits[k] = LogitFromOpacity(static_cast<float>(k) / 255);
    return logits;
  }();
  const size_t row_size = ply.vertex_size();
  for (int64_t n = 0; n < count; ++n, bytes += row_size) {
    uint32_t packed[4];
    for (size_t k = 0; k < 4; ++k) std::memcpy(&packed[k], bytes + ply.vertex_offsets[k], sizeof(uint32_t));
    const ChunkRanges& chunk = ply.chunks[static_cast<size_t>((first + n) / kCompressedPlyChunk)];
    const int64_t i = to + n;
    UnpackRanged(packed[0], chunk.mean_min, chunk.mean_max, cloud.means.data() + 3 * i);
    UnpackQuat(packed[1], cloud.quats.data() + 4 * i);
    UnpackRanged(packed[2], chunk.scale_min, chunk.scale_max, cloud.log_scales.data() + 3 * i);
    float* dc = cloud.sh.data() + i * cloud.sh_stride();
    for (int k = 0; k < 3; ++k) {
      const uint32_t bits = packed[3] >> (24 - 8 * k) & 255;
      dc[k] = DcFromColor(Mix(chunk.color_min[k], chunk.color_max[k], bits, 255));
    }
    cloud.opacity_logits[static_cast<size_t>(i)] = kLogits[packed[3] & 255];
  }
}

Status ReadHarmonics(const InputFile& file, const OpenedCompressedPly& ply, GaussianCloud& cloud) {
  const std::vector<size_t>& offsets = ply.harmonics_offsets;
  const size_t rest = offsets.size();
  std::array<float, 256> values{};
  for (size_t k = 1; k < 255; ++k) values[k] = (static_cast<float>(k) + 0.5f) / 256 * 8 - 4;
  values[0] = -4;
  values[255] = 4;
  const auto row_size = static_cast<size_t>(ply.harmonics.element->row_size());
  return ReadRecords(file, ply.harmonics.begin, cloud.size(), row_size,
                     [&](int64_t first, int64_t last, const uint8_t* bytes) {
                       for (int64_t i = first; i < last; ++i, bytes += row_size) {
                         float* out = cloud.sh.data() + i * cloud.sh_stride() + 3;
                         for (size_t k = 0; k < rest / 3; ++k) {
                           for (size_t channel = 0; channel < 3; ++channel)
                             *out++ = values[bytes[offsets[channel * (rest / 3) + k]]];
                         }
                       }
                     });
}

// SH bytes always decode to finite numbers, so they need not be read.
class CompressedPlyBlocks final : public FileBlocks {
 public:
  CompressedPlyBlocks(const InputFile& file, OpenedCompressedPly ply) : file_(file), ply_(std::move(ply)) {
    size_ = ply_.count();
    sh_degree_ = ply_.degree;
    render_mode_ = ply_.header.render_mode;
    comments_ = ply_.header.comments;
    origin_ = ply_.header.origin;
  }

 private:
  Status Fill(int64_t first, int64_t last, Scratch& scratch, std::span<uint8_t>) override {
    return ReadRows(file_, ply_.vertices.begin, ply_.vertex_size(), first, last, scratch.bytes,
                    [&](const uint8_t* bytes, int64_t count, int64_t to) {
                      UnpackVertices(ply_, bytes, first + to, count, to, scratch.rows);
                    });
  }
  Status EndFirstPass() override {
    WarnOfUnknownModeTags(file_, ply_.header);
    return {};
  }

  const InputFile& file_;
  OpenedCompressedPly ply_;
};

}  // namespace

Result<CloudExtent> ExtentOfCompressedPly(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(file));
  const PlyElement* const vertex = header.Find("vertex");
  if (vertex == nullptr) return BadHeader(file, "it has no element \"vertex\"");
  if (static_cast<uint64_t>(vertex->count) > file.size()) {
    return BadHeader(file, Cat("line ", vertex->line, ": it has fewer bytes than Gaussians"));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int degree, HarmonicsDegree(file, header.Find("sh")));
  return CloudExtent{vertex->count, degree};
}

Result<GaussianCloud> ReadCompressedPly(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(OpenedCompressedPly ply, OpenCompressedPly(file, limits));
  GaussianCloud cloud;
  cloud.Resize(ply.count(), ply.degree);
  ANCHORSPLAT_RETURN_IF_ERROR(ReadRecords(file, ply.vertices.begin, ply.count(), ply.vertex_size(),
                                          [&](int64_t first, int64_t last, const uint8_t* bytes) {
                                            UnpackVertices(ply, bytes, first, last - first, first, cloud);
                                          }));
  if (ply.degree > 0) ANCHORSPLAT_RETURN_IF_ERROR(ReadHarmonics(file, ply, cloud));
  WarnOfUnknownModeTags(file, ply.header);
  cloud.render_mode = ply.header.render_mode;
  cloud.comments = std::move(ply.header.comments);
  cloud.origin = ply.header.origin;
  return cloud;
}

Result<std::unique_ptr<CloudBlocks>> BlocksOfCompressedPly(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(OpenedCompressedPly ply, OpenCompressedPly(file, limits));
  return std::unique_ptr<CloudBlocks>(std::make_unique<CompressedPlyBlocks>(file, std::move(ply)));
}

Result<FormatFacts> DescribeCompressedPly(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(file));
  FormatFacts facts;
  if (const PlyElement* chunks = header.Find("chunk")) {
    facts.Add("chunks", WithThousands(chunks->count), " of up to ", kCompressedPlyChunk);
    facts.Add("colours", chunks->Find("min_r") != nullptr ? "in a range per chunk" : "from 0 to 1");
  }
  std::string others;
  for (const PlyElement& element : header.elements) {
    const bool known = element.name == "chunk" || element.name == "vertex" || element.name == "sh";
    if (!known) others += Cat(others.empty() ? "" : ", ", element.name);
    for (const PlyProperty& property : element.properties) {
      const auto has = [&property](const auto& names) {
        return std::ranges::find(names, property.name) != names.end();
      };
      if (!known || property.name.starts_with("f_rest_") || has(kVertexProperties) || has(kChunkProperties)) continue;
      others += Cat(others.empty() ? "" : ", ", element.name, ".", property.name);
    }
  }
  if (!others.empty()) facts.Add("other properties, ignored", Printable(others, 200));
  const PlyElement* harmonics = header.Find("sh");
  facts.Add("harmonics", harmonics == nullptr ? "none" : Cat(harmonics->properties.size(), " bytes per Gaussian"));
  return facts;
}

}  // namespace anchorsplat

#include "formats/registry.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

#include "core/text.h"
#include "formats/compressed_ply/compressed_ply_reader.h"
#include "formats/compressed_ply/compressed_ply_writer.h"
#include "formats/extra_properties.h"
#include "formats/gltf/gltf_blocks.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/gltf_writer.h"
#include "formats/gsplat_checkpoint/gsplat_checkpoint.h"
#include "formats/ksplat/ksplat_reader.h"
#include "formats/ply/ply_blocks.h"
#include "formats/ply/ply_reader.h"
#include "formats/ply/ply_writer.h"
#include "formats/sog/sog_blocks.h"
#include "formats/sog/sog_reader.h"
#include "formats/sog/sog_writer.h"
#include "formats/splat/splat_reader.h"
#include "formats/splat/splat_writer.h"
#include "formats/spz/spz_blocks.h"
#include "formats/spz/spz_reader.h"
#include "formats/spz/spz_writer.h"
#include "formats/strays.h"
#include "formats/streamed_sog/streamed_sog_reader.h"
#include "formats/streamed_sog/streamed_sog_writer.h"
#include "formats/tables/table_writers.h"

namespace anchorsplat {

namespace {

bool IsPly(std::string_view head) {
  return head.starts_with("ply") && head.find_first_of("\r\n") == head.find_first_not_of(" \t", 3);
}

// Whether it starts like a JSON object, after a byte order mark and whitespace.
bool IsJsonObject(std::string_view head) {
  if (head.starts_with("\xef\xbb\xbf")) head.remove_prefix(3);
  const size_t first = head.find_first_not_of(" \t\r\n");
  return first != head.npos && head[first] == '{';
}
bool Has(std::string_view head, std::string_view key) { return head.find(key) != head.npos; }

// PlayCanvas's compressed PLY has chunk ranges in an element before the vertices.
bool IsCompressedPly(std::string_view head) { return IsPly(head) && head.find("\nelement chunk ") != head.npos; }

// Version 4 has a magic number; earlier ones are gzip streams.
bool IsSpz(std::string_view head) { return head.starts_with("NGSP") || head.starts_with("\x1f\x8b"); }

// A ZIP archive, or a folder's JSON file: the only one of our formats with "means".
bool IsSog(std::string_view head) {
  return head.starts_with("PK\x03\x04") || (IsJsonObject(head) && Has(head, "\"means\"") && Has(head, "\"quats\""));
}

// The JSON file that lists the chunks of a scene.
bool IsStreamedSog(std::string_view head) { return IsJsonObject(head) && Has(head, "\"lodLevels\""); }

// NumPy's archive: a ZIP archive whose first member, of any name, is an array.
bool IsNpz(std::string_view head) {
  constexpr size_t kNameSize = 26, kName = 30;  // offsets in a member's header
  if (!head.starts_with("PK\x03\x04") || head.size() < kName) return false;
  const auto byte = [head](size_t at) { return static_cast<size_t>(static_cast<unsigned char>(head[at])); };
  return head.substr(kName, byte(kNameSize) + 256 * byte(kNameSize + 1)).ends_with(".npy");
}

bool IsGltf(std::string_view head) { return head.starts_with("glTF"); }

// Keys come in any order; a SOG has an "asset" too.
bool IsGltfJson(std::string_view head) {
  constexpr std::string_view kKeys[] = {"\"accessors\"", "\"bufferViews\"", "\"buffers\"", "\"meshes\"", "\"scenes\""};
  return IsJsonObject(head) && !IsSog(head) && Has(head, "\"asset\"") &&
         std::ranges::any_of(kKeys, [head](std::string_view key) { return Has(head, key); });
}

bool IsCsv(std::string_view head) { return head.starts_with("x,y,z,f_dc_0,"); }

constexpr std::string_view kCompressedPlyExtensions[] = {".compressed.ply"};
constexpr std::string_view kPlyExtensions[] = {".ply"};
constexpr std::string_view kSpzExtensions[] = {".spz"};
constexpr std::string_view kGsplatExtensions[] = {".pt", ".pth", ".ckpt"};
constexpr std::string_view kSogExtensions[] = {".sog", "meta.json"};
constexpr std::string_view kStreamedSogExtensions[] = {"lod-meta.json"};
constexpr std::string_view kSplatExtensions[] = {".splat"};
constexpr std::string_view kKsplatExtensions[] = {".ksplat"};
constexpr std::string_view kGltfExtensions[] = {".glb"};
constexpr std::string_view kGltfJsonExtensions[] = {".gltf"};
constexpr std::string_view kCsvExtensions[] = {".csv"};
constexpr std::string_view kNpzExtensions[] = {".npz"};

constexpr FormatRange kCompressedPlyRange = {.log_scale_min = -20, .log_scale_max = 20, .harmonics = 4};
constexpr FormatRange kSpzRange = {.log_scale_min = -10.03f, .log_scale_max = 5.97f, .dc = 3.346f, .harmonics = 1.03f};
constexpr FormatRange kSogRange = {.log_scale_min = -20, .log_scale_max = 20};
constexpr FormatRange kSplatRange = {.sh_degree = 0, .dc = 1.779f};

constexpr SplatFormat kFormats[] = {
    {.name = "compressed PLY",
     .extensions = kCompressedPlyExtensions,
     .sniff = IsCompressedPly,
     .extent = ExtentOfCompressedPly,
     .describe = DescribeCompressedPly,
     .read = ReadCompressedPly,
     .blocks = BlocksOfCompressedPly,
     .write = WriteCompressedPly,
     .predicted_size = PredictedCompressedPlySize,
     .order = SplatOrder::kMorton,
     .range = kCompressedPlyRange,
     .mode_tag = ModeTag::kEach,
     .comments = CommentPlace::kAll,
     .keeps_origin = true,
     .strays = CompressedPlyStrays,
     .mean_loss = CompressedPlyMeanLoss},
    {.name = "PLY",
     .extensions = kPlyExtensions,
     .sniff = IsPly,
     .extent = ExtentOfPly,
     .describe = DescribePly,
     .read = ReadPly,
     .blocks = BlocksOfPly,
     .read_with_extras = ReadPlyWithExtras,
     .write = WritePly,
     .write_with_extras = WritePlyWithExtras,
     .keeps_all_values = true,
     .predicted_size = [](int64_t count, int sh_degree) { return PredictedPlySize(count, sh_degree); },
     .mode_tag = ModeTag::kEach,
     .comments = CommentPlace::kAll,
     .keeps_origin = true},
    {.name = "SPZ",
     .article = "an",
     .extensions = kSpzExtensions,
     .sniff = IsSpz,
     .extent = ExtentOfSpz,
     .describe = DescribeSpz,
     .read = ReadSpz,
     .blocks = BlocksOfSpz,
     .write = WriteSpz,
     .predicted_size = EstimatedSpzSize,
     .size_is_estimate = true,
     .seconds_per_gaussian = 7e-7,
     .axes = kRub,
     .declared_axes = DeclaredAxesOfSpz,
     .range = kSpzRange,
     .mode_tag = ModeTag::kCompensated,
     .strays = SpzStrays,
     .mean_loss = SpzMeanLoss},
    {.name = "NPZ",
     .article = "an",
     .extensions = kNpzExtensions,
     .sniff = IsNpz,
     .write = WriteNpz,
     .keeps_all_values = true,
     .predicted_size = PredictedNpzSize,
     .keeps_origin = true},
    {.name = "gsplat checkpoint",
     .extensions = kGsplatExtensions,
     .sniff = IsTorchCheckpoint,
     .size = GsplatCheckpointSize,
     .read = ReadGsplatCheckpoint},
    {.name = "streamed SOG",
     .extensions = kStreamedSogExtensions,
     .sniff = IsStreamedSog,
     .describe = DescribeStreamedSog,
     .size = StreamedSogSize,
     .read = ReadStreamedSog,
     .write = WriteStreamedSog,
     .written_rows = StreamedSogRows,
     .several_files = true,
     .predicted_size = EstimatedStreamedSogSize,
     .size_is_estimate = true,
     .seconds_per_gaussian = 5e-5,
     .order = SplatOrder::kMorton,
     .range = kSogRange,
     .mode_tag = ModeTag::kCompensated,
     .comments = CommentPlace::kCredits,
     .keeps_origin = true},
    {.name = "SOG",
     .extensions = kSogExtensions,
     .sniff = IsSog,
     .describe = DescribeSog,
     .size = SogSize,
     .read = ReadSog,
     .blocks = BlocksOfSog,
     .write = WriteSog,
     .written_beside = SogFilesBeside,
     .predicted_size = EstimatedSogSize,
     .size_is_estimate = true,
     .seconds_per_gaussian = 2e-5,
     .order = SplatOrder::kMorton,
     .range = kSogRange,
     .mode_tag = ModeTag::kCompensated,
     .comments = CommentPlace::kCredits,
     .keeps_origin = true,
     .strays = SogStrays,
     .mean_loss = SogMeanLoss},
    {.name = "splat",
     .extensions = kSplatExtensions,
     .looks_like = LooksLikeSplat,
     .extent = [](const InputFile& file) -> Result<CloudExtent> {
       return CloudExtent{static_cast<int64_t>(file.size() / kSplatRecord), 0};
     },
     .read = ReadSplat,
     .blocks = BlocksOfSplat,
     .write = WriteSplat,
     .predicted_size = PredictedSplatSize,
     .order = SplatOrder::kImportance,
     .range = kSplatRange},
    {.name = "ksplat",
     .extensions = kKsplatExtensions,
     .looks_like = LooksLikeKsplat,
     .describe = DescribeKsplat,
     .read = ReadKsplat,
     .blocks = BlocksOfKsplat},
    {.name = "glTF",
     .extensions = kGltfExtensions,
     .sniff = IsGltf,
     .describe = DescribeGltf,
     .size = GltfSize,
     .read = ReadGltf,
     .blocks = BlocksOfGltf,
     .write = WriteGlb,
     .predicted_size = PredictedGlbSize,
     .axes = kLuf,
     .comments = CommentPlace::kCredits,
     .keeps_origin = true},
    {.name = "glTF as JSON",
     .extensions = kGltfJsonExtensions,
     .sniff = IsGltfJson,
     .describe = DescribeGltf,
     .size = GltfSize,
     .read = ReadGltf,
     .blocks = BlocksOfGltf,
     .write = WriteGltf,
     .written_beside = [](const std::filesystem::path& path, int) { return std::vector{GltfFileBeside(path)}; },
     .predicted_size = EstimatedGltfSize,
     .size_is_estimate = true,
     .axes = kLuf,
     .comments = CommentPlace::kCredits,
     .keeps_origin = true},
    {.name = "CSV",
     .extensions = kCsvExtensions,
     .sniff = IsCsv,
     .write = WriteCsv,
     .keeps_all_values = true,
     .predicted_size = EstimatedCsvSize,
     .size_is_estimate = true,
     .seconds_per_gaussian = 4e-6,
     .keeps_origin = true},
};

}  // namespace

std::span<const SplatFormat> Formats() { return kFormats; }

const SplatFormat* FormatOfExtension(const std::filesystem::path& path) {
  std::string name = path.filename().string();
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const SplatFormat* best = nullptr;
  size_t longest = 0;
  for (const SplatFormat& format : Formats()) {
    for (const std::string_view extension : format.extensions) {
      const bool fits = extension.starts_with('.') ? name.ends_with(extension) : name == extension;
      if (fits && extension.size() > longest) {
        best = &format;
        longest = extension.size();
      }
    }
  }
  return best;
}

const SplatFormat* FormatOfName(std::string_view name) {
  if (name.empty()) return nullptr;
  const SplatFormat* const format = FormatOfExtension(Cat("x", name.starts_with('.') ? "" : ".", name));
  const auto is_whole_name = [name](const SplatFormat& one) {
    return std::ranges::find(one.extensions, name) != one.extensions.end();
  };
  const auto named = std::ranges::find_if(Formats(), is_whole_name);
  return format == nullptr && named != Formats().end() ? &*named : format;
}

const SplatFormat* FormatOfFile(std::string_view head, const std::filesystem::path& path) {
  for (const SplatFormat& format : Formats()) {
    if (format.sniff != nullptr && format.sniff(head)) return &format;
  }
  return FormatOfExtension(path);
}

Result<const SplatFormat*> FormatOfFile(const InputFile& file, const std::filesystem::path& name) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(kSniffBytes));
  const SplatFormat* const found = FormatOfFile(head, name);
  const auto is = [&](const SplatFormat& one) {
    return one.sniff != nullptr ? one.sniff(head) : one.looks_like != nullptr && one.looks_like(file);
  };
  if (found == nullptr || is(*found)) return found;
  const auto other = std::ranges::find_if(Formats(), is);
  return other != Formats().end() ? &*other : found;
}

}  // namespace anchorsplat

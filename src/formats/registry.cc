#include "formats/registry.h"

#include <array>
#include <cctype>
#include <string>

#include "formats/compressed_ply_reader.h"
#include "formats/compressed_ply_writer.h"
#include "formats/gltf_reader.h"
#include "formats/gltf_writer.h"
#include "formats/gsplat_checkpoint.h"
#include "formats/ksplat_reader.h"
#include "formats/ply_reader.h"
#include "formats/ply_writer.h"
#include "formats/sog_reader.h"
#include "formats/sog_writer.h"
#include "formats/splat_reader.h"
#include "formats/splat_writer.h"
#include "formats/spz_reader.h"
#include "formats/spz_writer.h"
#include "formats/table_writers.h"

namespace anchorsplat {

namespace {

bool IsPly(std::string_view head) { return head.starts_with("ply\n") || head.starts_with("ply\r"); }

// PlayCanvas's packed PLY keeps the ranges of its chunks in an element before the vertices.
bool IsCompressedPly(std::string_view head) { return IsPly(head) && head.find("\nelement chunk ") != head.npos; }

// Version 4 begins with its own mark, earlier ones are gzip streams.
bool IsSpz(std::string_view head) { return head.starts_with("NGSP") || head.starts_with("\x1f\x8b"); }

// A ZIP archive, or the JSON file of a folder: the only one of our formats that speaks of means.
bool IsSog(std::string_view head) {
  return head.starts_with("PK\x03\x04") ||
         (head.starts_with("{") && head.find("\"means\"") != head.npos && head.find("\"quats\"") != head.npos);
}

bool IsGltf(std::string_view head) { return head.starts_with("glTF"); }

constexpr std::string_view kCompressedPlyExtensions[] = {".compressed.ply"};
constexpr std::string_view kPlyExtensions[] = {".ply"};
constexpr std::string_view kSpzExtensions[] = {".spz"};
constexpr std::string_view kGsplatExtensions[] = {".pt", ".pth"};
constexpr std::string_view kSogExtensions[] = {".sog", "meta.json"};
constexpr std::string_view kSplatExtensions[] = {".splat"};
constexpr std::string_view kKsplatExtensions[] = {".ksplat"};
constexpr std::string_view kGltfExtensions[] = {".glb"};
constexpr std::string_view kGltfJsonExtensions[] = {".gltf"};
constexpr std::string_view kCsvExtensions[] = {".csv"};
constexpr std::string_view kNpzExtensions[] = {".npz"};

constexpr SplatFormat kFormats[] = {
    {"compressed PLY", kCompressedPlyExtensions, IsCompressedPly, ReadCompressedPly, WriteCompressedPly,
     PredictedCompressedPlySize, SplatOrder::kMorton},
    {"PLY", kPlyExtensions, IsPly, ReadPly, WritePly,
     [](int64_t count, int sh_degree) { return PredictedPlySize(count, sh_degree); }},
    {"SPZ", kSpzExtensions, IsSpz, ReadSpz, WriteSpz, nullptr, SplatOrder::kKeep, kRub},
    {"gsplat checkpoint", kGsplatExtensions, IsTorchCheckpoint, ReadGsplatCheckpoint, nullptr, nullptr},
    {"SOG", kSogExtensions, IsSog, ReadSog, WriteSog, nullptr, SplatOrder::kMorton},
    {"splat", kSplatExtensions, nullptr, ReadSplat, WriteSplat, PredictedSplatSize, SplatOrder::kImportance},
    {"ksplat", kKsplatExtensions, nullptr, ReadKsplat, nullptr, nullptr},
    {"glTF", kGltfExtensions, IsGltf, ReadGltf, WriteGlb, nullptr, SplatOrder::kKeep, kLuf},
    {"glTF as JSON", kGltfJsonExtensions, nullptr, ReadGltf, nullptr, nullptr, SplatOrder::kKeep, kLuf},
    {"CSV", kCsvExtensions, nullptr, nullptr, WriteCsv, nullptr},
    {"NPZ", kNpzExtensions, nullptr, nullptr, WriteNpz, PredictedNpzSize},
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
      if (extension.size() > longest && name.ends_with(extension)) {
        best = &format;
        longest = extension.size();
      }
    }
  }
  return best;
}

const SplatFormat* FormatOfFile(std::string_view head, const std::filesystem::path& path) {
  for (const SplatFormat& format : Formats()) {
    if (format.sniff != nullptr && format.sniff(head)) return &format;
  }
  return FormatOfExtension(path);
}

}  // namespace anchorsplat

#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/axes.h"
#include "formats/cloud_io.h"
#include "formats/input_file.h"

namespace anchorsplat {

// A splat format: how it is recognised, and a function for each direction that this version knows. A new format is one
// file per direction and one row in registry.cc.
struct SplatFormat {
  std::string_view name;  // "PLY", in messages: "is a … file"
  // Lower case, with the dot; the longest match wins, so ".compressed.ply" goes before ".ply".
  std::span<const std::string_view> extensions;
  // Whether a file that begins with `head` (its first kSniffBytes bytes, or all) is of this format. Null where the
  // format has no mark of its own: then the extension decides.
  bool (*sniff)(std::string_view head);
  // Null: recognised, but not read or not written by this version.
  Result<GaussianCloud> (*read)(const InputFile& file, const ReadLimits& limits);
  Status (*write)(const std::filesystem::path& path, const GaussianCloud& cloud, const WriteOptions& options);
  // Bytes of the file `write` makes of a cloud without comments. Null where it depends on the values.
  uint64_t (*predicted_size)(int64_t count, int sh_degree);
  // The order in which `write` puts Gaussians by default.
  SplatOrder order = SplatOrder::kKeep;
  // What the axes of its files are by its own convention.
  Axes axes = kRdf;
};

inline constexpr size_t kSniffBytes = 4096;

// All known formats; those with a more special mark first.
std::span<const SplatFormat> Formats();

// By content first and extension second; null when neither is known.
const SplatFormat* FormatOfFile(std::string_view head, const std::filesystem::path& path);
const SplatFormat* FormatOfExtension(const std::filesystem::path& path);

// ReadCloud of a file that is open already.
Result<GaussianCloud> ReadOpenCloud(const InputFile& file, const ReadLimits& limits = {});

}  // namespace anchorsplat

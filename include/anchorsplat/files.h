#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/export.h>
#include <anchorsplat/run.h>
#include <anchorsplat/splat.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace anchorsplat {

// A splat format, as docs/formats.md describes it.
struct FileFormat {
  std::string name = {};                     // "SPZ", for people
  std::vector<std::string> extensions = {};  // ".spz"; the first one is what functions here are told
  bool is_read = false, is_written = false;
};
ANCHORSPLAT_PUBLIC std::vector<FileFormat> FileFormats();

// In which order Gaussians go into a file.
enum class GaussianOrder {
  kFormat,      // as the format likes it
  kKeep,        // as in the splat
  kMorton,      // neighbours in space are neighbours in the file
  kImportance,  // largest size × opacity first
};

struct WriteSettings {
  bool overwrite = false;  // an existing file is kExists otherwise
  GaussianOrder order = GaussianOrder::kFormat;
  int spz_version = 4;  // 3 or 4
};

// Reads a splat of any known format, found by its content first and its extension second; a folder with a meta.json is
// a SOG. Values that are not finite come through: functions that cannot use such a Gaussian leave it out and say so.
// Failures: kNotFound; kIo; kBadFile with byte or line, property and what was expected.
ANCHORSPLAT_PUBLIC Expected<Splat> ReadSplat(const std::filesystem::path& path, const RunSettings& run = {});

// The same of the bytes of a file in memory, which are not copied. `format` is its extension (".spz", "spz"), for those
// formats that have no mark of their own; empty: found by the content. What consists of several files (a SOG's
// meta.json, a glTF with numbers beside it) is kBadFile: nothing but the bytes is looked at.
ANCHORSPLAT_PUBLIC Expected<Splat> ReadSplat(std::span<const std::byte> bytes, std::string_view format = {},
                                             const RunSettings& run = {});

// Writes a splat in the format of the extension. The file appears whole or not at all; what of harmonics, ranges,
// render mode and credits (comments "credit: …") the format has no place for is a message of the run. Other comments
// stay behind in silence where docs/formats.md says that a format has no place for them. Failures: kExists; kNotFound
// (its folder); kIo; kBadArgument: no Gaussians, CheckShape, an extension that is not written.
ANCHORSPLAT_PUBLIC Expected<void> WriteSplat(const std::filesystem::path& path, const SplatView& splat,
                                             const WriteSettings& settings = {}, const RunSettings& run = {});

// The bytes that file would have. kBadArgument too: a format of several files (".gltf": ".glb" is one).
ANCHORSPLAT_PUBLIC Expected<std::vector<std::byte>> WriteSplatBytes(const SplatView& splat, std::string_view format,
                                                                    const WriteSettings& settings = {},
                                                                    const RunSettings& run = {});

}  // namespace anchorsplat

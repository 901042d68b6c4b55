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

// A splat format, see docs/formats.md.
struct FileFormat {
  std::string name = {};                     // "SPZ", for people
  std::vector<std::string> extensions = {};  // ".spz"; pass the first one to functions here
  bool is_read = false, is_written = false;
};
ANCHORSPLAT_PUBLIC std::vector<FileFormat> FileFormats();

// Order of Gaussians in a file.
enum class GaussianOrder {
  kFormat,      // the format's preferred order
  kKeep,        // as in the splat
  kMorton,      // neighbours in space are neighbours in the file
  kImportance,  // largest size × opacity first
};

struct WriteSettings {
  bool overwrite = false;  // false: an existing file is kExists
  GaussianOrder order = GaussianOrder::kFormat;
  int spz_version = 4;  // 3 or 4
};

// Reads a splat of any known format, recognised by content, else by extension. A folder with a meta.json is a SOG.
// Non-finite values are kept: functions that cannot use such a Gaussian leave it out and say so.
// Failures: kNotFound; kIo; kBadFile with byte or line, property and what was expected.
ANCHORSPLAT_PUBLIC Expected<Splat> ReadSplat(const std::filesystem::path& path, const RunSettings& run = {});

// The same from a file's bytes, which are not copied. `format`: its extension (".spz", "spz"), for formats without a
// signature; empty: recognised by content. Formats of several files (a SOG's meta.json, a glTF with separate buffers)
// are kBadFile.
ANCHORSPLAT_PUBLIC Expected<Splat> ReadSplat(std::span<const std::byte> bytes, std::string_view format = {},
                                             const RunSettings& run = {});

// Writes a splat in the format of the extension, atomically. Messages of the run name what the format cannot store of
// SH, value ranges, render mode and credits (comments "credit: …"); other comments may be dropped silently, as listed
// in docs/formats.md. Failures: kExists; kNotFound: its folder; kIo; kBadArgument: no Gaussians, CheckShape, an
// extension that cannot be written.
ANCHORSPLAT_PUBLIC Expected<void> WriteSplat(const std::filesystem::path& path, const SplatView& splat,
                                             const WriteSettings& settings = {}, const RunSettings& run = {});

// The bytes of such a file. Also kBadArgument: a format of several files (for ".gltf" use ".glb").
ANCHORSPLAT_PUBLIC Expected<std::vector<std::byte>> WriteSplatBytes(const SplatView& splat, std::string_view format,
                                                                    const WriteSettings& settings = {},
                                                                    const RunSettings& run = {});

}  // namespace anchorsplat

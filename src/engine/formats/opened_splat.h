#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/cloud_blocks.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/registry.h"
#include "io/input_file.h"

namespace anchorsplat {

// An opened splat file, opened once because pipes can be read only once. A folder with a meta.json or lod-meta.json
// means that file (SOG, streamed SOG); "-" is standard input. Compression and archives (gzip, zstd, ZIP) are removed
// (wrapped_splat.h); all members refer to the contents.
class OpenedSplat {
 public:
  // `format`: forces the format; null: detect it by content, then extension. Errors: those of InputFile::Open and
  // Unwrap; kBadFile: a folder without a splat, an empty file, a file known to be something else.
  static Result<OpenedSplat> Open(const std::filesystem::path& path, const SplatFormat* format = nullptr);
  // The same for an open file or bytes in memory.
  static Result<OpenedSplat> Of(InputFile input, const SplatFormat* format = nullptr);

  const InputFile& input() const { return input_; }
  const SplatFormat* format() const { return format_; }  // null: unknown, Read() will fail
  const std::string& packed() const { return packed_; }  // removed compression, for messages; usually empty
  // Of the file as stored, including compression and files that belong to it.
  uint64_t bytes() const;
  // Size from the header; none if unknown before reading, or if reading will fail.
  std::optional<CloudExtent> Extent() const;
  // Reads the splat. `extras`, if given, receives extra properties. Errors: see ReadCloud.
  Result<GaussianCloud> Read(const ReadLimits& limits = {}, ExtraProperties* extras = nullptr) const;
  // The same, block by block: directly from the file if possible, with little memory, else from a copy of all. This
  // object must outlive the blocks and not move. Errors: those of Read, some of them from CloudBlocks::ForEach.
  Result<std::unique_ptr<CloudBlocks>> Blocks(const ReadLimits& limits = {}) const;

 private:
  OpenedSplat(InputFile input, const SplatFormat* format) : input_(std::move(input)), format_(format) {}

  InputFile input_;
  const SplatFormat* format_;
  std::string packed_;
  uint64_t packed_bytes_ = 0;
};

// The file that OpenedSplat opens for a path: for folders see splat_folder.h; other paths are unchanged.
std::filesystem::path SplatPath(const std::filesystem::path& path);

// OpenedSplat::Extent for a file that can be reopened; none for pipes and files that cannot be opened.
std::optional<CloudExtent> ExtentOf(const std::filesystem::path& path, const SplatFormat* format = nullptr);

// Records a splat that will be read later as an input, with the files that belong to it (input_record.h).
void RecordSplat(const std::filesystem::path& path);

}  // namespace anchorsplat

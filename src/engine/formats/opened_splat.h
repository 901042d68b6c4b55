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

// A splat file that is open: opened once, as a pipe can be read only once. A folder with a meta.json or a
// lod-meta.json in it stands for that file (SOG, streamed SOG); "-" is standard input. What is around a splat, gzip,
// zstd or a ZIP archive, is taken away (wrapped_splat.h): everything here is about what is in it.
class OpenedSplat {
 public:
  // `format`: what the file is, whatever its content and name say; null: by content first and extension second.
  // Errors: of InputFile::Open; kBadFile for a folder that is no splat, for an empty file, for what is known to be
  // something else, and those of Unwrap.
  static Result<OpenedSplat> Open(const std::filesystem::path& path, const SplatFormat* format = nullptr);
  // The same of a file that is open, or of bytes in memory. Errors: the same.
  static Result<OpenedSplat> Of(InputFile input, const SplatFormat* format = nullptr);

  const InputFile& input() const { return input_; }
  const SplatFormat* format() const { return format_; }  // null: not known, Read() will fail
  const std::string& packed() const { return packed_; }  // what was around it, for people; mostly empty
  // Of the file as it is, packed or with the files beside it that belong to it.
  uint64_t bytes() const;
  // How much it holds, by its header; nothing where that is not known before it is read, or where reading will fail.
  std::optional<CloudExtent> Extent() const;
  // Errors: see ReadCloud. `extras` gets what the file says beside its Gaussians, if not null.
  Result<GaussianCloud> Read(const ReadLimits& limits = {}, ExtraProperties* extras = nullptr) const;
  // The same Gaussians to look at block by block: straight from the file where it can be read so, which takes little
  // memory, else all of it is read. This must outlive it and stay where it is. Errors: of Read; some of them come from
  // CloudBlocks::ForEach.
  Result<std::unique_ptr<CloudBlocks>> Blocks(const ReadLimits& limits = {}) const;

 private:
  OpenedSplat(InputFile input, const SplatFormat* format) : input_(std::move(input)), format_(format) {}

  InputFile input_;
  const SplatFormat* format_;
  std::string packed_;
  uint64_t packed_bytes_ = 0;
};

// What OpenedSplat opens for a path: the splat of a folder (splat_folder.h), other paths as they are.
std::filesystem::path SplatPath(const std::filesystem::path& path);

// OpenedSplat::Extent of a file that can be opened again afterwards; nothing for pipes and for what cannot be opened.
std::optional<CloudExtent> ExtentOf(const std::filesystem::path& path, const SplatFormat* format = nullptr);

// Puts a splat that will be read later down as an input, with the files beside it that belong to it (input_record.h).
void RecordSplat(const std::filesystem::path& path);

}  // namespace anchorsplat

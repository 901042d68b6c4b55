#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// A splat file after removing compression.
struct UnwrappedSplat {
  InputFile file;
  // name with the extension: "scan.ply" for scan.ply.gz, or the member's name in an archive
  std::filesystem::path name;
  std::string packed;  // for messages: "gzip around 3.4 MB"; empty if nothing was removed
};

// Removes gzip, zstd and ZIP archives of one splat, at most two layers. They are recognised by content; compression
// that is part of a format stays: the gzip stream of SPZ, the archives of SOG, NPZ and PyTorch.
//
// Errors (kBadFile): damaged, truncated, a decompression bomb, an archive with no splat or several, which are named.
Result<UnwrappedSplat> Unwrap(InputFile input);

// "scan.ply" for "scan.ply.gz", "scan" for "scan.zip"; other names are unchanged.
std::filesystem::path WithoutPacking(const std::filesystem::path& name);

// Whether Unwrap would remove something, or needs the whole file to tell.
bool IsWrapped(const InputFile& file);

// Describes common non-splat files by their first bytes, with what to do: "is a web page and no splat"; empty for
// anything that may be a splat.
std::string DescribeNonSplat(std::string_view head);
// Whether `head` is readable text, such as a server's response instead of a file.
bool IsText(std::string_view head);

}  // namespace anchorsplat

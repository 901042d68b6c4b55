#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// A splat file without what was around it.
struct UnwrappedSplat {
  InputFile file;
  std::filesystem::path name;  // what tells its extension: "scan.ply" of scan.ply.gz, the name that an archive says
  std::string packed;          // for people: "gzip around 3.4 MB"; empty: there was nothing around it
};

// Takes gzip, zstd and ZIP archives of one splat away, two of them at most. They are recognised by content, and what
// formats are made of themselves stays: the gzip stream of an SPZ, the archives of SOG, NPZ and PyTorch.
//
// Errors (kBadFile): damaged, cut off, a decompression bomb, an archive of no splat or of several, whose names are
// said.
Result<UnwrappedSplat> Unwrap(InputFile input);

// "scan.ply" of "scan.ply.gz", "scan" of "scan.zip"; other names as they are.
std::filesystem::path WithoutPacking(const std::filesystem::path& name);

// Whether Unwrap has something to take away, or all of the file to look at for it.
bool IsWrapped(const InputFile& file);

// What people take for a splat, by its first bytes, with what to do: "is a web page and no splat"; empty for anything
// that may be one.
std::string WhatElse(std::string_view head);
// Whether all of it can be read by people, as an answer of a server in place of a file.
bool IsText(std::string_view head);

}  // namespace anchorsplat

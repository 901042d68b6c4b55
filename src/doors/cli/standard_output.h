#pragma once

#include <filesystem>
#include <iosfwd>
#include <memory>
#include <string>
#include <string_view>

#include "cli/verb.h"
#include "core/result.h"
#include "io/output_memory.h"

namespace anchorsplat {

inline constexpr const char* kPipedFormatHelp = "With -o -: format, by its extension";

// Whether an output is called so that it goes to standard output: "-" or /dev/stdout.
bool IsStandardOutput(const std::filesystem::path& output);

// A file that goes to standard output, whole or not at all: writers put it into memory under a name, and Send() passes
// it on. Results for people go to stderr meanwhile.
class StandardOutput {
 public:
  // For a file that has this extension. Errors (kBadArgument): standard output is a terminal, or --json writes there.
  static Result<StandardOutput> Open(const std::string& extension, const SharedFlags& shared);
  // For a splat: ".spz" or "spz". Errors, too: no format that is written, or one of several files.
  static Result<StandardOutput> ForSplat(const std::string& format, const SharedFlags& shared);

  const std::filesystem::path& path() const { return path_; }  // of the file, for writers and messages
  OutputMemory* memory() const { return memory_.get(); }       // where it is to be put
  // kIo: standard output could not be written, as when nobody reads it any more.
  Status Send() const;

 private:
  explicit StandardOutput(std::filesystem::path path)
      : path_(std::move(path)), memory_(std::make_unique<OutputMemory>()) {}

  std::filesystem::path path_;
  std::unique_ptr<OutputMemory> memory_;
};

// An output as people know it: nobody has seen the name that writers get for standard output.
std::string OutputName(const std::filesystem::path& output, const OutputMemory* piped);
// kBadArgument where a folder for outputs is called as standard output is, which cannot take several.
Status CheckOutDir(const std::string& folder);

// Where results for people go.
std::ostream& ResultsBeside(const OutputMemory* piped);

}  // namespace anchorsplat

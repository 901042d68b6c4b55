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

// Whether the name of an output means standard output: "-" or /dev/stdout.
bool IsStandardOutput(const std::filesystem::path& output);

// A file that goes to standard output, whole or not at all: writers write it to memory under a name, and Send() sends
// it. Results for people go to stderr.
class StandardOutput {
 public:
  // For a file with this extension. Errors (kBadArgument): standard output is a terminal, or --json uses it.
  static Result<StandardOutput> Open(const std::string& extension, const SharedFlags& shared);
  // For a splat: ".spz" or "spz". Also kBadArgument: a format that cannot be written, or has several files.
  static Result<StandardOutput> ForSplat(const std::string& format, const SharedFlags& shared);

  const std::filesystem::path& path() const { return path_; }  // of the file, for writers and messages
  OutputMemory* memory() const { return memory_.get(); }       // where it is to be put
  // kIo: writing failed, as when the reader has gone.
  Status Send() const;

 private:
  explicit StandardOutput(std::filesystem::path path)
      : path_(std::move(path)), memory_(std::make_unique<OutputMemory>()) {}

  std::filesystem::path path_;
  std::unique_ptr<OutputMemory> memory_;
};

// Name of an output for messages, instead of the internal name of standard output.
std::string OutputName(const std::filesystem::path& output, const OutputMemory* piped);
// kBadArgument if the name of an output folder means standard output.
Status CheckOutDir(const std::string& folder);

// Where results for people go.
std::ostream& ResultsBeside(const OutputMemory* piped);

}  // namespace anchorsplat

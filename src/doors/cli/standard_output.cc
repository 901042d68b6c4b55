#include "cli/standard_output.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <iostream>
#include <span>
#include <system_error>

#include "cli/clean_output.h"
#include "core/gaussian_cloud.h"
#include "core/text.h"
#include "formats/cloud_output.h"
#include "formats/registry.h"

namespace anchorsplat {

namespace {

constexpr const char* kName = "standard output";

// A pipe without a reader is an error, like a full disk.
Status WriteAll(std::span<const std::byte> bytes) {
  auto* const before = std::signal(SIGPIPE, SIG_IGN);
  int error = 0;
  while (!bytes.empty() && error == 0) {
    const ssize_t n = ::write(STDOUT_FILENO, bytes.data(), std::min<size_t>(bytes.size(), size_t{1} << 20));
    if (n >= 0) bytes = bytes.subspan(static_cast<size_t>(n));
    if (n < 0 && errno != EINTR) error = errno;
  }
  std::signal(SIGPIPE, before);
  if (error == 0) return {};
  return Error{ErrorCode::kIo, Cat("cannot write to ", kName, ": ", std::generic_category().message(error))};
}

}  // namespace

bool IsStandardOutput(const std::filesystem::path& output) { return output == "-" || output == "/dev/stdout"; }

Result<StandardOutput> StandardOutput::Open(const std::string& extension, const SharedFlags& shared) {
  if (shared.json) {
    return Error{ErrorCode::kBadArgument, "--json and -o - both need standard output: write to a file"};
  }
  if (::isatty(STDOUT_FILENO) == 1) {
    return Error{ErrorCode::kBadArgument, "standard output is a terminal: redirect it to a file or a program (> or |)"};
  }
  return StandardOutput(kName + extension);
}

Result<StandardOutput> StandardOutput::ForSplat(const std::string& name, const SharedFlags& shared) {
  const SplatFormat* const format = FormatOfName(name);
  if (format == nullptr || format->write == nullptr) {
    std::string written;
    for (const SplatFormat& one : Formats()) {
      if (one.write != nullptr) written += Cat(" ", one.extensions.front());
    }
    return Error{ErrorCode::kBadArgument, Cat("--to: '", Printable(name), "' cannot be written; supported:", written)};
  }
  const std::string extension(format->extensions.front());
  const bool is_folder = name.ends_with(".json");
  if (format->several_files || is_folder || FilesOfCloud("x" + extension, kMaxShDegree).size() > 1) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--to ", Printable(name), " writes several files, and standard output is one")};
  }
  return Open(extension, shared);
}

Status StandardOutput::Send() const {
  std::cout.flush();
  return WriteAll(memory_->files.at(path_));
}

std::string OutputName(const std::filesystem::path& output, const OutputMemory* piped) {
  return piped != nullptr ? kName : OneLine(output);
}

Status CheckOutDir(const std::string& folder) {
  if (!IsStandardOutput(folder)) return {};
  return Error{ErrorCode::kBadArgument, Cat("--out-dir ", folder, ": means standard output (./- names a folder)")};
}

std::ostream& ResultsBeside(const OutputMemory* piped) { return piped != nullptr ? std::cerr : std::cout; }

}  // namespace anchorsplat

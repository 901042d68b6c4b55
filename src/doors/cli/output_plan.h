#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "cli/verb.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// What verbs that write splats are told about large ones.
struct SizeFlags {
  uint64_t max_memory = 0;  // bytes; 0: DefaultMaxMemory()
  bool yes = false;

  void AddTo(CLI::App& verb);
  uint64_t memory() const;  // bytes of all
  // Of them, what large arrays may take (core/memory_limit.h).
  uint64_t arrays() const { return memory() / 4 * 3; }
};

// A quarter of the machine's memory: what lies in temporary files is kept in the rest by the system as
// long as nobody else needs it.
uint64_t DefaultMaxMemory();

// A Gaussian's row of all arrays of a cloud, in bytes.
constexpr uint64_t RowBytes(int sh_degree) {
  return sizeof(float) * (11 + 3 * static_cast<uint64_t>(ShCoefficients(sh_degree)));
}

// What is known of an output before the work begins.
struct OutputPlan {
  std::string input;
  std::filesystem::path output;
  int64_t gaussians_in = 0;
  int64_t gaussians = 0;  // at most
  uint64_t bytes = 0;     // of the output, at most
  bool roughly = false;   // they depend on the values
  uint64_t needed = 0;    // of arrays, in memory or on disk, at most
  std::optional<double> seconds = std::nullopt;
};

// From here on a file is asked for.
inline constexpr uint64_t kLargeOutput = 4'000'000'000;

// Says what will come out of one command and what it takes, unless that is little; asks where all of it together is
// more than kLargeOutput or than the disk has room for. kBadArgument: nobody can be asked (no terminal) or the answer
// was no, and there is no --yes.
Status SayAndAsk(std::span<const OutputPlan> plans, const SizeFlags& flags, const SharedFlags& shared);

// Bytes that can be stored where this file will be, in a folder that may not be there yet. Nothing where the system
// does not say, nor where nothing can be stored at all (/proc), which writing says better.
std::optional<uint64_t> RoomFor(const std::filesystem::path& output);

}  // namespace anchorsplat

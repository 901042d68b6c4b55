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

// Options about large splats.
struct SizeFlags {
  uint64_t max_memory = 0;  // bytes; 0: DefaultMaxMemory()
  bool yes = false;

  void AddTo(CLI::App& verb);
  uint64_t memory() const;  // bytes of all
  // Memory for large arrays (core/memory_limit.h).
  uint64_t arrays() const { return memory() / 4 * 3; }
};

// A quarter of the machine's memory. The system caches temporary files in the rest.
uint64_t DefaultMaxMemory();

// Bytes of one Gaussian in all arrays of a cloud.
constexpr uint64_t RowBytes(int sh_degree) {
  return sizeof(float) * (11 + 3 * static_cast<uint64_t>(ShCoefficients(sh_degree)));
}

// What is known about an output before the work.
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

// Larger outputs need confirmation.
inline constexpr uint64_t kLargeOutput = 4'000'000'000;

// Reports an expected output and its cost, unless small.
void Say(const OutputPlan& plan, const SizeFlags& flags);

// Reports the outputs of a command and asks for confirmation if together they exceed kLargeOutput or the free disk
// space; returns whether it did. kBadArgument: no --yes, and no terminal to ask on or the answer was no.
Result<bool> AskIfLarge(std::span<const OutputPlan> plans, const SizeFlags& flags, const SharedFlags& shared);

// Both.
Status SayAndAsk(std::span<const OutputPlan> plans, const SizeFlags& flags, const SharedFlags& shared);

// Free bytes on the disk of this file, whose folder may not exist yet. Unset if unknown, or if nothing can be stored
// there
// (/proc), for which writing gives the better error.
std::optional<uint64_t> RoomFor(const std::filesystem::path& output);

}  // namespace anchorsplat

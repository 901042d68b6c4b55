#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/log.h"
#include "core/messages_for_test.h"
#include "core/parallel.h"
#include "formats/blocks_for_test.h"

namespace anchorsplat {

// Reads a file whole and block by block, with all threads and with one, and expects equal results, including warnings.
// Reader tests use it, so that they test blocks too.
inline Result<GaussianCloud> ReadBothWays(ReadFunction read, BlocksFunction open, const InputFile& file,
                                          const ReadLimits& limits = {}) {
  std::vector<std::string> warnings, notes;
  Result<GaussianCloud> cloud = [&] {
    const Messages messages;
    auto result = read(file, limits);
    warnings = messages.warnings();
    notes = messages.notes();
    return result;
  }();
  // A file that must be read whole reports nothing earlier.
  const bool has_blocks = [&] {
    const Messages unheard;
    const auto blocks = open(file, limits);
    return blocks.ok() && *blocks != nullptr;
  }();
  for (const int threads : {0, 1}) {
    SetThreadCount(threads);
    const Messages messages;
    EXPECT_EQ(DifferenceOfBlocks(open, file, limits, cloud), "") << file.name() << " with threads: " << threads;
    if (cloud.ok() && has_blocks) {
      EXPECT_EQ(messages.warnings(), warnings);
      EXPECT_EQ(messages.notes(), notes);
    }
  }
  SetThreadCount(0);
  for (const std::string& text : warnings) LogWarning(text);
  for (const std::string& text : notes) LogInfo(text);
  return cloud;
}

}  // namespace anchorsplat

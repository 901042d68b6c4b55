#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/verb.h"
#include "core/result.h"

namespace anchorsplat {

// One of several inputs, with its output.
struct BatchItem {
  std::string input, output;
};

// Runs `run` for each item and prints the rows it returns with --json. If one of several items fails, the others are
// still done: its row has a `failure`, and the program ends with kPartialExitCode. Errors: that of a single item; the
// last one if all failed; kInterrupted at once.
Status RunBatch(const std::vector<BatchItem>& items, const std::function<Result<nlohmann::json>(size_t)>& run,
                Program& program);

}  // namespace anchorsplat

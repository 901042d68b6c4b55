#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/verb.h"
#include "core/result.h"

namespace anchorsplat {

// One of several inputs of a verb that makes a file of each.
struct BatchItem {
  std::string input, output;
};

// Runs `run` for each item and prints the rows of results it returns, as --json asks for. What is wrong with one of
// several is said and does not keep the others from being done: its row has a `failure`, and the program ends with
// kPartialExitCode. Errors: that of the only item; of the last one where none could be done; kInterrupted at once.
Status RunBatch(const std::vector<BatchItem>& items, const std::function<Result<nlohmann::json>(size_t)>& run,
                Program& program);

}  // namespace anchorsplat

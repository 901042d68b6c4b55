#include "cli/batch.h"

#include <iostream>
#include <nlohmann/json.hpp>

#include "core/log.h"
#include "core/text.h"

namespace anchorsplat {

Status RunBatch(const std::vector<BatchItem>& items, const std::function<Result<nlohmann::json>(size_t)>& run,
                Program& program) {
  nlohmann::json rows = nlohmann::json::array();
  size_t failed = 0;
  for (size_t k = 0; k < items.size(); ++k) {
    const BatchItem& item = items[k];
    const Result<nlohmann::json> row = run(k);
    std::cout.flush();  // before messages about later files
    if (row.ok()) {
      rows.push_back(*row);
      continue;
    }
    Error error = row.error();
    if (items.size() == 1 || error.code == ErrorCode::kInterrupted) return error;
    if (error.message.find(item.input) == std::string::npos) error.message = Cat(item.input, ": ", error.message);
    if (++failed == items.size()) {
      return Error{error.code, Cat("all ", failed, " inputs failed. The last error: ", error.message)};
    }
    LogError(error.message);
    rows.push_back({{"input", item.input},
                    {"output", item.output},
                    {"failure", {{"code", CodeName(error.code)}, {"message", error.message}}}});
  }
  if (program.flags.json) PrintJson(rows);
  if (failed > 0) {
    LogError(Cat(failed, " of ", items.size(), " files failed"));
    program.exit_code = kPartialExitCode;
  }
  return {};
}

}  // namespace anchorsplat

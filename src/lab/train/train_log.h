#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <utility>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// log.jsonl of a training, one JSON object per line, and the page curve.html that is drawn of it. A training that goes
// on from a checkpoint goes on with the log as it was at that step.
class TrainLog {
 public:
  // `resume_at`: keep the lines up to that step; 0: begin a new file. Errors: kIo.
  static Result<TrainLog> Open(const std::filesystem::path& folder, int64_t resume_at);

  // Appends a line at once, so that whoever watches sees it. It must have "step".
  Status Add(const nlohmann::json& line);
  Status WriteCurve() const;

 private:
  void Remember(const nlohmann::json& line);

  std::filesystem::path folder_;
  std::vector<std::pair<double, double>> loss_, model_;  // (step, value)
  double raw_ = 0, filter_ = 0;                          // PSNR; 0: not measured
};

}  // namespace anchorsplat

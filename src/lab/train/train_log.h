#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <utility>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// The log of a training, log.jsonl (one JSON object per line), and its plot, curve.html. A resumed training continues
// the log from its checkpoint's step.
class TrainLog {
 public:
  // `resume_at`: keeps lines up to that step; 0: new file. Errors: kIo.
  static Result<TrainLog> Open(const std::filesystem::path& folder, int64_t resume_at);

  // Appends a line and flushes it. It must have "step".
  Status Add(const nlohmann::json& line);
  Status WriteCurve() const;

 private:
  void Remember(const nlohmann::json& line);

  std::filesystem::path folder_;
  std::vector<std::pair<double, double>> loss_, model_;  // (step, value)
  double raw_ = 0, filter_ = 0;                          // PSNR; 0: not measured
};

}  // namespace anchorsplat

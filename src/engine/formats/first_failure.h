#pragma once

#include <cstdint>
#include <mutex>

#include "core/result.h"

namespace anchorsplat {

// Keeps the failure of the lowest row, so that errors do not depend on thread timing.
class FirstFailure {
 public:
  void Report(int64_t row, const Status& status) {
    if (status.ok()) return;
    const std::lock_guard lock(mutex_);
    if (row < row_) {
      row_ = row;
      status_ = status;
    }
  }
  const Status& status() const { return status_; }

 private:
  std::mutex mutex_;
  int64_t row_ = INT64_MAX;
  Status status_;
};

}  // namespace anchorsplat

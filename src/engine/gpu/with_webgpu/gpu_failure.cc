#include "gpu/with_webgpu/gpu_failure.h"

#include <algorithm>

#include "core/text.h"

namespace anchorsplat {

bool IsDeviceLost(const std::string& message) { return message.find("device is lost") != std::string::npos; }

std::string ReasonOf(const std::string& message) {
  std::string reason;
  size_t at = 0;
  while (at < message.size()) {
    const size_t end = std::min(message.find('\n', at), message.size());
    std::string line = message.substr(at, end - at);
    line.erase(0, std::min(line.find_first_not_of(' '), line.size()));
    if (!line.empty()) reason = line;
    at = end + 1;
  }
  return Printable(reason, 200);
}

void GpuFailure::Set(const std::string& sentence) {
  const std::lock_guard lock(mutex_);
  if (happened_) return;
  sentence_ = IsDeviceLost(sentence) ? kGpuLost : sentence;
  happened_.store(true, std::memory_order_release);
}

Error GpuFailure::error() const {
  const std::lock_guard lock(mutex_);
  return {ErrorCode::kIo, sentence_};
}

}  // namespace anchorsplat

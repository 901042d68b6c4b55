#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

#include "core/text.h"
#include "gpu/with_webgpu/webgpu_buffer.h"
#include "gpu/with_webgpu/webgpu_device.h"

namespace anchorsplat {

namespace {
constexpr uint64_t kPiece = 64 << 20;        // bytes per transfer
constexpr uint64_t kMaxWritten = 256 << 20;  // bytes that the queue may hold as copies
}  // namespace

void WebGpuDevice::Write(const GpuBuffer& buffer, uint64_t offset, std::span<const std::byte> data) {
  const Working working(*this);
  if (failed() || data.empty()) return;
  // Queue writes come before anything not yet submitted.
  if (Buffer::LastUsed(buffer) == recording_) SubmitRecorded();
  for (uint64_t at = 0; at < data.size() && !failed(); at += kPiece) {
    const uint64_t bytes = std::min<uint64_t>(kPiece, data.size() - at);
    instance_.api()->QueueWriteBuffer(queue_, Buffer::HandleOf(buffer), offset + at, data.data() + at, bytes);
    bytes_written_ += bytes;
    if (bytes_written_ > kMaxWritten) WaitForQueue();
  }
}

template <typename Ask>
bool WebGpuDevice::WaitForAnswer(const Ask& ask) {
  struct Answer {
    bool done = false, good = false;
  };
  auto* const answer = new Answer;  // freed by the callback
  ++waits_;
  const WGPUFuture future = ask(answer);
  const bool answered = instance_.WaitUntil([&] { return answer->done; }, device_, future);
  if (!answered) {
    failure_->Set(instance_.broken() ? kGpuLost : "the device does not answer");
    return false;
  }
  const std::unique_ptr<Answer> done(answer);
  if (!done->good) failure_->Set(kGpuLost);
  return done->good && !failed();
}

bool WebGpuDevice::WaitForQueue() {
  SubmitRecorded();
  if (failed()) return false;
  submits_ = 0;
  if (bytes_written_ > 0) {  // written since, not submitted automatically
    if (!HandOver(0, nullptr)) return false;
    bytes_written_ = 0;
  }
  return WaitForAnswer([&](auto* answer) {
    WGPUQueueWorkDoneCallbackInfo callback = WGPU_QUEUE_WORK_DONE_CALLBACK_INFO_INIT;
    callback.mode = WGPUCallbackMode_AllowProcessEvents;
    callback.callback = [](WGPUQueueWorkDoneStatus status, WGPUStringView, void* to, void*) {
      auto& answered = *static_cast<decltype(answer)>(to);
      answered.good = status == WGPUQueueWorkDoneStatus_Success;
      answered.done = true;
    };
    callback.userdata1 = answer;
    return instance_.api()->QueueOnSubmittedWorkDone(queue_, callback);
  });
}

Status WebGpuDevice::Wait() {
  const Working working(*this);
  if (!failed()) WaitForQueue();
  return FailureOr();
}

bool WebGpuDevice::EnsureStaging(uint64_t bytes) {
  if (bytes <= staging_bytes_) return true;
  uint64_t size = 1 << 16;
  while (size < bytes) size *= 2;
  if (staging_ != nullptr) {
    instance_.api()->BufferDestroy(staging_);
    instance_.api()->BufferRelease(staging_);
    staging_ = nullptr;
    staging_bytes_ = 0;
  }
  ScopedError error;
  staging_ = MakeBuffer(size, WGPUBufferUsage_MapRead | WGPUBufferUsage_CopyDst, "staging", error);
  if (staging_ == nullptr) {
    failure_->Set(Cat("there is no memory to read from the GPU (", error.message, ")"));
    return false;
  }
  staging_bytes_ = size;
  return true;
}

// Submits and maps the first bytes of `staging_`, to be unmapped afterwards. Null: the device has failed.
const std::byte* WebGpuDevice::MapStaging(uint64_t bytes) {
  SubmitRecorded();
  if (failed()) return nullptr;
  const bool mapped = WaitForAnswer([&](auto* answer) {
    WGPUBufferMapCallbackInfo callback = WGPU_BUFFER_MAP_CALLBACK_INFO_INIT;
    callback.mode = WGPUCallbackMode_AllowProcessEvents;
    callback.callback = [](WGPUMapAsyncStatus status, WGPUStringView, void* to, void*) {
      auto& answered = *static_cast<decltype(answer)>(to);
      answered.good = status == WGPUMapAsyncStatus_Success;
      answered.done = true;
    };
    callback.userdata1 = answer;
    return instance_.api()->BufferMapAsync(staging_, WGPUMapMode_Read, 0, bytes, callback);
  });
  if (!mapped) return nullptr;
  submits_ = 0;  // all submitted work is done
  bytes_written_ = 0;
  const void* const from = instance_.api()->BufferGetConstMappedRange(staging_, 0, bytes);
  if (from == nullptr) failure_->Set("what was calculated cannot be read");
  return static_cast<const std::byte*>(from);
}

// At most kPiece in total.
bool WebGpuDevice::ReadPieces(std::span<const GpuRead> pieces) {
  const WebGpuApi& api = *instance_.api();
  uint64_t bytes = 0;
  for (const GpuRead& piece : pieces) bytes += piece.to.size();
  if (!EnsureStaging(bytes)) return false;
  EndPass();
  BeginCommands();
  uint64_t at = 0;
  for (const GpuRead& piece : pieces) {
    api.CommandEncoderCopyBufferToBuffer(encoder_, Buffer::Use(*piece.buffer, recording_), piece.offset, staging_, at,
                                         piece.to.size());
    at += piece.to.size();
  }
  const std::byte* from = MapStaging(bytes);
  if (from == nullptr) return false;
  for (const GpuRead& piece : pieces) {
    std::memcpy(piece.to.data(), from, piece.to.size());
    from += piece.to.size();
  }
  api.BufferUnmap(staging_);
  return true;
}

Status WebGpuDevice::Read(std::span<const GpuRead> reads) {
  const Working working(*this);
  std::vector<GpuRead> pieces;
  uint64_t bytes = 0;
  for (const GpuRead& read : reads) {
    for (uint64_t at = 0; at < read.to.size() && !failed();) {
      const uint64_t part = std::min<uint64_t>(read.to.size() - at, kPiece - bytes);
      pieces.push_back({read.buffer, read.offset + at, read.to.subspan(at, part)});
      at += part;
      bytes += part;
      if (bytes < kPiece) continue;
      ReadPieces(pieces);
      pieces.clear();
      bytes = 0;
    }
  }
  if (!failed() && pieces.empty() && bytes == 0) WaitForQueue();
  if (!failed() && !pieces.empty()) ReadPieces(pieces);
  return FailureOr();
}

}  // namespace anchorsplat

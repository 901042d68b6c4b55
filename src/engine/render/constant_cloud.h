#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/cloud_view.h"
#include "core/result.h"
#include "gpu/device.h"
#include "render/gpu_cloud.h"

namespace anchorsplat {

// A constant cloud that several pictures are drawn of, so that a GPU receives it only once. The splat's arrays must not
// change while this lives. For one thread at a time.
class ConstantCloud {
 public:
  explicit ConstantCloud(const CloudView& cloud) : view_(cloud) {}
  explicit ConstantCloud(const GaussianCloud& cloud) : view_(cloud) {}
  explicit ConstantCloud(const GaussianCloud&&) = delete;  // temporaries would dangle
  ConstantCloud(const ConstantCloud&) = delete;
  ConstantCloud& operator=(const ConstantCloud&) = delete;

  const CloudView& view() const { return view_; }

  // For the rasterizer: its copy on the device, uploaded if needed. Errors: those of GpuCloud::Assign.
  Result<GpuCloud*> On(const std::shared_ptr<GpuDevice>& device) {
    if (device_ != device) Release();
    device_ = device;
    if (copy_.empty()) ANCHORSPLAT_RETURN_IF_ERROR(copy_.Assign(*device, view_));
    return &copy_;
  }
  // Frees the GPU memory.
  void Release() {
    copy_ = GpuCloud();
    device_.reset();
  }
  // Maximum pairs of its pictures drawn on a GPU; none if there are none.
  std::optional<int64_t> most_pairs() const { return most_pairs_; }
  void NotePairs(int64_t pairs) { most_pairs_ = std::max(most_pairs_.value_or(0), pairs); }

 private:
  CloudView view_;
  std::shared_ptr<GpuDevice> device_;
  GpuCloud copy_;
  std::optional<int64_t> most_pairs_;
};

}  // namespace anchorsplat

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

// A splat that stays as it is while several pictures are drawn of it: a GPU is given it once, not for every picture.
// Whoever draws several makes one and lets it go with them. As long as it lives, the arrays of the splat must not
// change. For one thread at a time.
class StillCloud {
 public:
  explicit StillCloud(const CloudView& cloud) : view_(cloud) {}
  explicit StillCloud(const GaussianCloud& cloud) : view_(cloud) {}
  explicit StillCloud(const GaussianCloud&&) = delete;  // it would be gone
  StillCloud(const StillCloud&) = delete;
  StillCloud& operator=(const StillCloud&) = delete;

  const CloudView& view() const { return view_; }

  // For the rasterizer: its copy on the device, uploaded if it is not there (yet, or any more). Errors: of
  // GpuCloud::Assign.
  Result<GpuCloud*> On(const std::shared_ptr<GpuDevice>& device) {
    if (device_ != device) Leave();
    device_ = device;
    if (copy_.empty()) ANCHORSPLAT_RETURN_IF_ERROR(copy_.Assign(*device, view_));
    return &copy_;
  }
  // Gives the GPU's memory back.
  void Leave() {
    copy_ = GpuCloud();
    device_.reset();
  }
  // Pairs of the picture of it that had most of those that were drawn on a GPU; none: nothing was drawn there.
  std::optional<int64_t> most_pairs() const { return most_pairs_; }
  void NotePairs(int64_t pairs) { most_pairs_ = std::max(most_pairs_.value_or(0), pairs); }

 private:
  CloudView view_;
  std::shared_ptr<GpuDevice> device_;
  GpuCloud copy_;
  std::optional<int64_t> most_pairs_;
};

}  // namespace anchorsplat

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat {

// Columns of a splat on a GPU, in blocks of rows that each fit a binding. Shapes and units as in GaussianCloud; a row
// of `sh` has 3·(sh_degree+1)² floats.
struct GpuCloudBlock {
  int64_t first = 0, count = 0;  // rows
  GpuMemory means;               // f32 [count,3]
  GpuMemory log_scales;          // f32 [count,3]
  GpuMemory quats;               // f32 [count,4] wxyz
  GpuMemory opacity_logits;      // f32 [count]
  GpuMemory sh;                  // f32 [count,K,3]
};

// A splat on the GPU: resident (Create), so that a fit need not upload it for every picture, or a copy of one in host
// memory (Assign). A copy that does not fit is streamed: it has memory for one block, uploaded on demand.
class GpuCloud {
 public:
  GpuCloud() = default;

  // A resident cloud of zeros. Errors: those of GpuDevice::Allocate.
  static Result<GpuCloud> Create(GpuDevice& device, int64_t count, int sh_degree);

  // Makes this a copy of `view`, whose arrays must not change until the next Assign or Drop. Reuses memory if shapes
  // match. Errors: no room for even one block.
  Status Assign(GpuDevice& device, const CloudView& view);

  int64_t size() const { return count_; }
  int sh_degree() const { return sh_degree_; }
  int64_t sh_stride() const { return int64_t{3} * ShCoefficients(sh_degree_); }  // floats
  bool resident() const { return resident_; }
  bool empty() const { return blocks_.empty(); }

  // Number of blocks, which cover rows 0 to size() in order.
  size_t block_count() const;
  // Valid until the next call, as a streamed cloud has memory for one block.
  const GpuCloudBlock& Block(GpuDevice& device, size_t k);
  // Only for a resident cloud.
  std::span<const GpuCloudBlock> blocks() const { return blocks_; }

  // Overwrites a resident cloud of the same shape with `view`.
  void Write(GpuDevice& device, const CloudView& view) const;
  // Reads `rows`, in that order, into host memory. Errors: those of GpuDevice::Read.
  Result<GaussianCloud> ReadRows(GpuDevice& device, std::span<const int64_t> rows) const;

  // Frees memory for other uses: a copy can switch to streaming or drop everything. A resident cloud cannot, as it
  // exists nowhere else.
  bool can_stream() const { return copy_ && resident_ && !blocks_.empty(); }
  Status Stream(GpuDevice& device);
  bool can_drop() const { return copy_ && !blocks_.empty(); }
  void Drop();

 private:
  static Result<GpuCloudBlock> MakeBlock(GpuDevice& device, int64_t first, int64_t count, int sh_degree);
  static void WriteBlock(GpuDevice& device, const CloudView& view, const GpuCloudBlock& block);

  int64_t count_ = 0;
  int sh_degree_ = 0;
  bool resident_ = true, copy_ = false;
  int64_t rows_per_block_ = 0;
  std::vector<GpuCloudBlock> blocks_;  // all, or the one that is streamed through
  CloudView host_;                     // source of a copy
};

}  // namespace anchorsplat

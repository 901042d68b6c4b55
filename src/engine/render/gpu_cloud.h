#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat {

// The columns of a splat on a GPU, in blocks of rows that each fit a binding. Shapes and units are those of
// GaussianCloud; a row of `sh` has 3·(sh_degree+1)² floats.
struct GpuCloudBlock {
  int64_t first = 0, count = 0;  // rows
  GpuMemory means;               // f32 [count,3]
  GpuMemory log_scales;          // f32 [count,3]
  GpuMemory quats;               // f32 [count,4] wxyz
  GpuMemory opacity_logits;      // f32 [count]
  GpuMemory sh;                  // f32 [count,K,3]
};

// A splat that stays on the GPU (Create), so that a fit need not upload it for every picture, or a copy of one in host
// memory (Assign) for one picture. A copy that does not fit is streamed: there is memory for one block, which is
// uploaded when it is asked for.
class GpuCloud {
 public:
  GpuCloud() = default;

  // Resident, all values 0. Errors: of GpuDevice::Allocate.
  static Result<GpuCloud> Create(GpuDevice& device, int64_t count, int sh_degree);

  // Becomes a copy of `view`, whose arrays must stay as they are until the next Assign or Drop. Memory of before is
  // used again where the shapes are the same. Errors: not even room for a block.
  Status Assign(GpuDevice& device, const CloudView& view);

  int64_t size() const { return count_; }
  int sh_degree() const { return sh_degree_; }
  int64_t sh_stride() const { return int64_t{3} * ShCoefficients(sh_degree_); }  // floats
  bool resident() const { return resident_; }
  bool empty() const { return blocks_.empty(); }

  // The rows of all blocks, in order, from 0 to size().
  size_t block_count() const;
  // Valid until the next call: a streamed cloud uploads the block to where the last one was.
  const GpuCloudBlock& Block(GpuDevice& device, size_t k);
  // Of a resident cloud.
  std::span<const GpuCloudBlock> blocks() const { return blocks_; }

  // Writes all of `view` to a resident cloud of the same shape.
  void Write(GpuDevice& device, const CloudView& view) const;
  // Some rows in host memory, in that order. Errors: of GpuDevice::Read.
  Result<GaussianCloud> ReadRows(GpuDevice& device, std::span<const int64_t> rows) const;

  // What a copy can do where memory is needed for other things: to be streamed from here on, or to give all of it back.
  // What a fit works on exists nowhere else and cannot.
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
  CloudView host_;                     // of a copy
};

}  // namespace anchorsplat

#include "render/gpu_cloud.h"

#include <algorithm>

#include "render/gpu_layout.h"

namespace anchorsplat {

namespace {

// Bytes of a streamed block: 15 MiB at degree 3, enough to keep a GPU busy, but a small part of the cloud.
constexpr int64_t kStreamedRows = int64_t{1} << 16, kStreamedBlocks = 8;
constexpr int64_t kRowsAtMost = int64_t{1} << 22;  // per block; keeps byte offsets far below 2^32

// Maximum rows of a block: its largest column must fit a binding.
int64_t RowsPerBlock(const GpuAdapter& adapter, int sh_degree) {
  const int64_t row = std::max<int64_t>(16, int64_t{12} * ShCoefficients(sh_degree));  // bytes
  const uint64_t largest = std::min(adapter.max_binding, adapter.max_buffer);
  const int64_t rows = static_cast<int64_t>(std::min<uint64_t>(largest, uint64_t{1} << 40)) / row;
  return std::clamp<int64_t>(rows / kGpuWorkgroupSize * kGpuWorkgroupSize, kGpuWorkgroupSize, kRowsAtMost);
}

template <typename T>
std::span<const std::byte> Rows(std::span<const T> column, int64_t first, int64_t count, int64_t width) {
  return std::as_bytes(column.subspan(static_cast<size_t>(first * width), static_cast<size_t>(count * width)));
}

}  // namespace

Result<GpuCloudBlock> GpuCloud::MakeBlock(GpuDevice& device, int64_t first, int64_t count, int sh_degree) {
  GpuCloudBlock block;
  block.first = first, block.count = count;
  const auto rows = static_cast<uint64_t>(count);
  const auto stride = 12 * static_cast<uint64_t>(ShCoefficients(sh_degree));
  const auto allocate = [&](GpuMemory& memory, uint64_t bytes, std::string_view what) -> Status {
    Result<GpuMemory> made = device.Allocate(rows * bytes, what);
    if (!made.ok()) return made.error();
    memory = std::move(made).value();
    return {};
  };
  ANCHORSPLAT_RETURN_IF_ERROR(allocate(block.means, 12, "the means of a splat"));
  ANCHORSPLAT_RETURN_IF_ERROR(allocate(block.log_scales, 12, "the scales of a splat"));
  ANCHORSPLAT_RETURN_IF_ERROR(allocate(block.quats, 16, "the rotations of a splat"));
  ANCHORSPLAT_RETURN_IF_ERROR(allocate(block.opacity_logits, 4, "the opacities of a splat"));
  ANCHORSPLAT_RETURN_IF_ERROR(allocate(block.sh, stride, "the spherical harmonics of a splat"));
  return block;
}

Result<GpuCloud> GpuCloud::Create(GpuDevice& device, int64_t count, int sh_degree) {
  GpuCloud cloud;
  cloud.count_ = count;
  cloud.sh_degree_ = sh_degree;
  cloud.rows_per_block_ = RowsPerBlock(device.adapter(), sh_degree);
  for (int64_t first = 0; first < count; first += cloud.rows_per_block_) {
    Result<GpuCloudBlock> block = MakeBlock(device, first, std::min(cloud.rows_per_block_, count - first), sh_degree);
    if (!block.ok()) return block.error();
    cloud.blocks_.push_back(std::move(block).value());
  }
  return cloud;
}

void GpuCloud::WriteBlock(GpuDevice& device, const CloudView& view, const GpuCloudBlock& block) {
  const auto write = [&](const GpuMemory& memory, std::span<const float> column, int64_t width) {
    device.Write(*memory, 0, Rows(column, block.first, block.count, width));
  };
  write(block.means, view.means, 3);
  write(block.log_scales, view.log_scales, 3);
  write(block.quats, view.quats, 4);
  write(block.opacity_logits, view.opacity_logits, 1);
  write(block.sh, view.sh, view.sh_stride());
}

void GpuCloud::Write(GpuDevice& device, const CloudView& view) const {
  for (const GpuCloudBlock& block : blocks_) WriteBlock(device, view, block);
}

Status GpuCloud::Assign(GpuDevice& device, const CloudView& view) {
  const int64_t count = view.size();
  if (!copy_ || blocks_.empty() || count_ != count || sh_degree_ != view.sh_degree) {
    *this = GpuCloud();  // free before the new allocation
    if (Result<GpuCloud> made = Create(device, count, view.sh_degree); made.ok()) {
      *this = std::move(made).value();
    } else {
      host_ = view;
      return Stream(device);
    }
    copy_ = true;
  }
  host_ = view;
  if (resident_) Write(device, view);
  return {};
}

Status GpuCloud::Stream(GpuDevice& device) {
  const CloudView view = host_;
  *this = GpuCloud();
  const int64_t part = (view.size() / kStreamedBlocks / kGpuWorkgroupSize + 1) * kGpuWorkgroupSize;
  const int64_t rows = std::min({view.size(), part, kStreamedRows, RowsPerBlock(device.adapter(), view.sh_degree)});
  Result<GpuCloudBlock> block = MakeBlock(device, 0, rows, view.sh_degree);
  if (!block.ok()) return block.error();
  blocks_.push_back(std::move(block).value());
  count_ = view.size(), sh_degree_ = view.sh_degree, rows_per_block_ = rows;
  resident_ = false, copy_ = true;
  host_ = view;
  return {};
}

size_t GpuCloud::block_count() const {
  if (resident_) return blocks_.size();
  return static_cast<size_t>((count_ + rows_per_block_ - 1) / rows_per_block_);
}

const GpuCloudBlock& GpuCloud::Block(GpuDevice& device, size_t k) {
  if (resident_) return blocks_[k];
  GpuCloudBlock& block = blocks_.front();
  block.first = static_cast<int64_t>(k) * rows_per_block_;
  block.count = std::min(rows_per_block_, count_ - block.first);
  WriteBlock(device, host_, block);
  return block;
}

Result<GaussianCloud> GpuCloud::ReadRows(GpuDevice& device, std::span<const int64_t> rows) const {
  if (copy_) return Subset(host_, rows);
  GaussianCloud cloud;
  cloud.Resize(static_cast<int64_t>(rows.size()), sh_degree_);
  std::vector<GpuRead> reads;
  reads.reserve(5 * rows.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    const GpuCloudBlock& block = blocks_[static_cast<size_t>(rows[i] / rows_per_block_)];
    const auto read = [&](const GpuMemory& memory, auto& column, size_t width) {
      const std::span<float> to(column.data() + i * width, width);
      reads.push_back(
          {memory.get(), static_cast<uint64_t>(rows[i] - block.first) * 4 * width, std::as_writable_bytes(to)});
    };
    read(block.means, cloud.means, 3);
    read(block.log_scales, cloud.log_scales, 3);
    read(block.quats, cloud.quats, 4);
    read(block.opacity_logits, cloud.opacity_logits, 1);
    read(block.sh, cloud.sh, static_cast<size_t>(sh_stride()));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(device.Read(reads));
  return cloud;
}

void GpuCloud::Drop() {
  if (copy_) *this = GpuCloud();
}

}  // namespace anchorsplat

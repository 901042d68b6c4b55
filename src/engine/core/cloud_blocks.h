#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Consecutive rows of a splat, with only the constant SH coefficient. Valid only during the call that receives it.
struct CloudBlock {
  int64_t first = 0;                // row of the splat at index 0 of the block; a multiple of kCloudBlockRows
  CloudView rows;                   // SH degree 0; means relative to CloudBlocks::origin
  std::span<const uint8_t> usable;  // per row: 1 if IsUsable, all SH coefficients considered

  int64_t size() const { return rows.size(); }
};
// Rows of a block (the last may have fewer), so that it fits in the cache.
inline constexpr int64_t kCloudBlockRows = 4096;

// A splat that is read block by block, from memory or from a file larger than memory.
class CloudBlocks {
 public:
  virtual ~CloudBlocks() = default;
  CloudBlocks(const CloudBlocks&) = delete;
  CloudBlocks& operator=(const CloudBlocks&) = delete;

  int64_t size() const { return size_; }
  int sh_degree() const { return sh_degree_; }
  const std::optional<RenderMode>& render_mode() const { return render_mode_; }
  const std::vector<std::string>& comments() const { return comments_; }
  const WorldOrigin& origin() const { return origin_; }

  // Calls `visit` once per block, from several threads in any order. Can be called again. Errors: reading the file.
  using Visitor = std::function<void(const CloudBlock&)>;
  virtual Status ForEach(const Visitor& visit) = 0;

 protected:
  CloudBlocks() = default;

  int64_t size_ = 0;
  int sh_degree_ = 0;
  std::optional<RenderMode> render_mode_;
  std::vector<std::string> comments_;
  WorldOrigin origin_ = {0, 0, 0};
  // [N] CloudBlock::usable, valid once ForEach has visited all rows.
  std::vector<uint8_t> usable_;
  bool usable_known_ = false;
};

// Blocks of columns in memory, which must outlive this object.
class MemoryBlocks final : public CloudBlocks {
 public:
  explicit MemoryBlocks(const CloudView& cloud);
  explicit MemoryBlocks(GaussianCloud cloud);  // takes ownership
  Status ForEach(const Visitor& visit) override;

 private:
  GaussianCloud owned_;
  CloudView cloud_;
};

// A computation over all rows of a splat in one or more passes. Its memory does not depend on the number of rows.
class RowStudy {
 public:
  virtual ~RowStudy() = default;
  virtual bool done() const = 0;                    // no further pass needed
  virtual void Visit(const CloudBlock& block) = 0;  // once per block and pass, from several threads in any order
  virtual void EndPass() = 0;
};

// Runs passes over `blocks`, shared by all studies, until every study is done. Errors: reading the file.
Status Study(CloudBlocks& blocks, std::span<RowStudy* const> studies);

}  // namespace anchorsplat

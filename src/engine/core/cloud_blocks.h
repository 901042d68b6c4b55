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

// Some neighbouring rows of a splat, without the harmonics that depend on the direction. Valid during a call.
struct CloudBlock {
  int64_t first = 0;                // the row of the splat that is row 0 here; a multiple of kCloudBlockRows
  CloudView rows;                   // SH degree 0; means from CloudBlocks::origin on
  std::span<const uint8_t> usable;  // per row: 1 where IsUsable, looking at all of its harmonics

  int64_t size() const { return rows.size(); }
};
inline constexpr int64_t kCloudBlockRows =
    4096;  // of a block, the last may have fewer: they stay in a processor's cache

// A splat to look at block by block, in memory or in a file that is larger than memory.
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

  // Calls `look` with every block once, from several threads in any order. May be called again. Errors: of reading.
  using Look = std::function<void(const CloudBlock&)>;
  virtual Status ForEach(const Look& look) = 0;

 protected:
  CloudBlocks() = default;

  int64_t size_ = 0;
  int sh_degree_ = 0;
  std::optional<RenderMode> render_mode_;
  std::vector<std::string> comments_;
  WorldOrigin origin_ = {0, 0, 0};
  // [N] CloudBlock::usable, known after ForEach has been through all rows for the first time.
  std::vector<uint8_t> usable_;
  bool usable_known_ = false;
};

// Of columns in memory, which must stay where they are.
class MemoryBlocks final : public CloudBlocks {
 public:
  explicit MemoryBlocks(const CloudView& cloud);
  explicit MemoryBlocks(GaussianCloud cloud);  // keeps it
  Status ForEach(const Look& look) override;

 private:
  GaussianCloud owned_;
  CloudView cloud_;
};

// What looks at all rows of a splat, once or more often, and remembers something of them whose size does not depend on
// their number.
class RowStudy {
 public:
  virtual ~RowStudy() = default;
  virtual bool done() const = 0;                   // needs no further pass
  virtual void Look(const CloudBlock& block) = 0;  // each block once in a pass, from several threads in any order
  virtual void EndPass() = 0;
};

// Goes through the rows until all studies are done, for all of them at once. Errors: of reading.
Status Study(CloudBlocks& blocks, std::span<RowStudy* const> studies);

}  // namespace anchorsplat

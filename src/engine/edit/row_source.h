#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/extra_properties.h"

namespace anchorsplat {

// Consecutive rows of a splat with all their data. Valid during a call.
struct RowBlock {
  int64_t first = 0;                        // splat row of row 0
  CloudView rows;                           // of the splat's SH degree; means relative to its origin
  const ExtraProperties* extras = nullptr;  // its row `extra_first` + i belongs to row i
  int64_t extra_first = 0;
  int64_t size() const { return rows.size(); }
};

// A splat to be read block by block, repeatedly, from memory or from a file larger than memory. Results must not depend
// on the division into blocks.
class RowSource {
 public:
  virtual ~RowSource() = default;
  RowSource(const RowSource&) = delete;
  RowSource& operator=(const RowSource&) = delete;

  virtual int64_t size() const = 0;
  // Calls `look` once per block, from several threads, in any order. Errors: those of reading.
  using Look = std::function<void(const RowBlock&)>;
  virtual Status ForEach(const Look& look) = 0;
  // Calls it with rows [first, last) as one block, on this thread.
  virtual Status Show(int64_t first, int64_t last, const Look& look) = 0;

 protected:
  RowSource() = default;
};

inline constexpr int64_t kRowsPerBlock = 2048;

// Rows [first, last) as a view.
CloudView RowsOf(const CloudView& cloud, int64_t first, int64_t last);

// Rows in memory, which must outlive this object.
class MemoryRows final : public RowSource {
 public:
  MemoryRows(const CloudView& cloud, const ExtraProperties& extras) : cloud_(cloud), extras_(extras) {}
  int64_t size() const override { return cloud_.size(); }
  Status ForEach(const Look& look) override;
  Status Show(int64_t first, int64_t last, const Look& look) override;

 private:
  CloudView cloud_;
  const ExtraProperties& extras_;
};

}  // namespace anchorsplat

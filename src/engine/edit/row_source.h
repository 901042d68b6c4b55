#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/extra_properties.h"

namespace anchorsplat {

// Neighbouring rows of a splat with all that is known of them. Valid during a call.
struct RowBlock {
  int64_t first = 0;                        // the row of the splat that is row 0 here
  CloudView rows;                           // of the splat's SH degree, means from its origin on
  const ExtraProperties* extras = nullptr;  // has row `extra_first` + i for row i
  int64_t extra_first = 0;
  int64_t size() const { return rows.size(); }
};

// A splat to look at block by block as often as needed, in memory or in a file that is larger than memory. What comes
// of the rows does not depend on how they are cut into blocks.
class RowSource {
 public:
  virtual ~RowSource() = default;
  RowSource(const RowSource&) = delete;
  RowSource& operator=(const RowSource&) = delete;

  virtual int64_t size() const = 0;
  // Calls `look` with every block once, from several threads in any order. Errors: of reading.
  using Look = std::function<void(const RowBlock&)>;
  virtual Status ForEach(const Look& look) = 0;
  // The same with the rows [first, last) as one block, on this thread.
  virtual Status Show(int64_t first, int64_t last, const Look& look) = 0;

 protected:
  RowSource() = default;
};

inline constexpr int64_t kRowsPerBlock = 2048;

// Rows [first, last) of columns.
CloudView RowsOf(const CloudView& cloud, int64_t first, int64_t last);

// Of columns in memory, which must stay where they are.
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

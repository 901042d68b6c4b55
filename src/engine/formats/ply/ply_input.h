#pragma once

#include <cstdint>
#include <optional>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/extra_properties.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/ply_layout.h"
#include "io/input_file.h"

namespace anchorsplat {

// ReadPlyWithExtras in pieces of rows, with all harmonics. Normals are kept even if all are zero.
class PlyInput {
 public:
  // Opens a file; none if its rows depend on others: text, lists, double-precision positions, colours instead of
  // f_dc_*, other colour spaces, 3-D filters. `file` must outlive it. Errors: those of ReadPly.
  static Result<std::optional<PlyInput>> Open(const InputFile& file, const ReadLimits& limits);

  PlyInput(PlyInput&&) = default;

  // The splat without rows.
  const GaussianCloud& head() const { return head_; }
  const ExtraProperties& extras() const { return extras_; }
  int64_t size() const { return count_; }
  // Replaces the contents of `rows` and `extras` by rows [first, last). Thread-safe.
  Status Read(int64_t first, int64_t last, GaussianCloud& rows, ExtraProperties& extras) const;
  // Warnings that the reader gives at its end.
  void Warn() const;

 private:
  PlyInput(const InputFile& file, PlyHeader header) : file_(&file), header_(std::move(header)) {}

  const InputFile* file_;
  PlyHeader header_;
  PlyLayout layout_;  // refers to header_, whose elements stay in place when moved
  uint64_t begin_ = 0;
  int64_t count_ = 0;
  bool has_normals_ = false;
  GaussianCloud head_;
  ExtraProperties extras_;
};

}  // namespace anchorsplat

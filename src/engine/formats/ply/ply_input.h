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

// What ReadPlyWithExtras gives, some rows at a time and with all their harmonics; normals that are zero throughout are
// normals here.
class PlyInput {
 public:
  // Nothing for files whose rows cannot be told without the others: text, lists, positions in double precision, colours
  // in the place of f_dc_*, other colour spaces, 3-D filters. `file` must outlive it. Errors: of ReadPly.
  static Result<std::optional<PlyInput>> Open(const InputFile& file, const ReadLimits& limits);

  PlyInput(PlyInput&&) = default;

  // Without rows.
  const GaussianCloud& head() const { return head_; }
  const ExtraProperties& extras() const { return extras_; }
  int64_t size() const { return count_; }
  // Rows [first, last) in place of those that `rows` and `extras` have. From several threads.
  Status Read(int64_t first, int64_t last, GaussianCloud& rows, ExtraProperties& extras) const;
  // What reading says at its end.
  void Warn() const;

 private:
  PlyInput(const InputFile& file, PlyHeader header) : file_(&file), header_(std::move(header)) {}

  const InputFile* file_;
  PlyHeader header_;
  PlyLayout layout_;  // of header_, whose elements stay where they are when it moves
  uint64_t begin_ = 0;
  int64_t count_ = 0;
  bool has_normals_ = false;
  GaussianCloud head_;
  ExtraProperties extras_;
};

}  // namespace anchorsplat

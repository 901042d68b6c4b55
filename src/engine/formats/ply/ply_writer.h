#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/extra_properties.h"
#include "io/atomic_file.h"

namespace anchorsplat {

// Writes a Gaussian splat as the INRIA code does: binary little-endian floats in the order x y z, nx ny nz (zeros),
// f_dc_0..2, f_rest_* (channel-major), opacity, scale_0..2, rot_0..3. The values are the stored ones, bit by bit, but
// for a cloud of `double_means`, whose x y z are world coordinates in double; otherwise a comment says the origin. The
// render mode and the comments go to the header (control bytes in comments become blanks, so that they stay comments).
// Streamed in blocks: needs no second copy of the cloud.
// Errors: kExists, kIo, kBadArgument (arrays that disagree, no Gaussians, comments longer than a header may be).
Status WritePly(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// The same with the normals of `extras`, and its properties behind ours. kBadArgument too: it has not a row for each
// Gaussian; names longer than a header may be.
Status WritePlyWithExtras(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options,
                          const ExtraProperties& extras);

// The same of a splat of which only some rows are there at a time. Rows may be written in any order and from several
// threads.
class PlyOutput {
 public:
  // `head`: what the splat is like, whose rows do not count; `extras`: what properties there will be.
  static Result<PlyOutput> Create(const std::filesystem::path& path, const CloudView& head, int64_t count,
                                  const CloudWriteOptions& options, const ExtraProperties& extras);
  // Rows [first, last) of `rows`, which are like the head, become row `to` of the file and on.
  Status Write(const CloudView& rows, const ExtraProperties& extras, int64_t first, int64_t last, int64_t to) const;
  Status Commit() { return file_.Commit(); }
  size_t row_size() const { return row_size_; }

 private:
  PlyOutput(OutputFile file, size_t header, size_t row_size)
      : file_(std::move(file)), header_(header), row_size_(row_size) {}

  OutputFile file_;
  size_t header_, row_size_;  // bytes
};

// Bytes of the file WritePly makes of `count` Gaussians.
uint64_t PredictedPlySize(int64_t count, int sh_degree, std::optional<RenderMode> render_mode = {},
                          std::span<const std::string> comments = {});

// Bytes that WritePlyWithExtras writes beyond those of `count` Gaussians like `head`, whose rows do not count, but for
// the names of properties and the comments.
uint64_t ExtraPlyBytes(const CloudView& head, int64_t count, const ExtraProperties& extras);

}  // namespace anchorsplat

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

// Writes a Gaussian splat like INRIA's code: binary little-endian floats x y z, nx ny nz (zeros), f_dc_0..2, f_rest_*
// (channel-major), opacity, scale_0..2, rot_0..3. Values are bit-exact as stored; with `double_means`, x y z are world
// coordinates in double, else a comment gives the origin. The header has render mode and comments (control bytes become
// spaces, so that they stay comments). Streamed in blocks, without a second copy of the cloud. Errors: kExists, kIo,
// kBadArgument (inconsistent arrays, no Gaussians, comments too long for a header).
Status WritePly(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// The same with the normals and, after ours, the properties of `extras`. Also kBadArgument: `extras` lacks rows; names
// too long for a header.
Status WritePlyWithExtras(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options,
                          const ExtraProperties& extras);

// The same for a splat that is written in pieces, in any order and from several threads.
class PlyOutput {
 public:
  // `head`: a cloud like the splat, whose rows are ignored; `extras`: its properties.
  static Result<PlyOutput> Create(const std::filesystem::path& path, const CloudView& head, int64_t count,
                                  const CloudWriteOptions& options, const ExtraProperties& extras);
  // Writes rows [first, last) of `rows`, which must be like `head`, as rows of the file from `to` on.
  Status Write(const CloudView& rows, const ExtraProperties& extras, int64_t first, int64_t last, int64_t to) const;
  Status Commit() { return file_.Commit(); }
  size_t row_size() const { return row_size_; }

 private:
  PlyOutput(OutputFile file, size_t header, size_t row_size)
      : file_(std::move(file)), header_(header), row_size_(row_size) {}

  OutputFile file_;
  size_t header_, row_size_;  // bytes
};

// Bytes of a file that WritePly writes.
uint64_t PredictedPlySize(int64_t count, int sh_degree, std::optional<RenderMode> render_mode = {},
                          std::span<const std::string> comments = {});

// Bytes that WritePlyWithExtras adds for `count` Gaussians like `head` (its rows are ignored), except property names
// and comments.
uint64_t ExtraPlyBytes(const CloudView& head, int64_t count, const ExtraProperties& extras);

}  // namespace anchorsplat

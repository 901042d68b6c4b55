#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/cloud_blocks.h"
#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/axes.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

struct ExtraProperties;
struct Strays;

// What a format can hold; writers clamp what is beyond. Half a step of the format wider than its last values.
struct FormatRange {
  int sh_degree = kMaxShDegree;
  float log_scale_min = -std::numeric_limits<float>::infinity();
  float log_scale_max = std::numeric_limits<float>::infinity();
  float dc = std::numeric_limits<float>::infinity();         // largest |f_dc|
  float harmonics = std::numeric_limits<float>::infinity();  // largest |coefficient| of degree 1–3
};

// What a file of the format says about the render mode.
enum class ModeTag {
  kNone,
  kCompensated,  // whether opacity is compensated, and not for which dilation: read as kAntialiased
  kEach,
};

// Which of a splat's comments go into a file of the format and come back.
enum class CommentPlace {
  kNone,
  kCredits,  // those that say whose it is or that it has all its width (core/splat_comments.h)
  kAll,
};

// A splat format: how it is recognised, and a function for each direction that this version knows. A new format is one
// file per direction and one row in registry.cc.
struct SplatFormat {
  std::string_view name;           // "PLY", in messages: "is a … file"
  std::string_view article = "a";  // that goes before the name as it is spoken
  // Lower case; the longest match wins, so ".compressed.ply" goes before ".ply". Those without a dot in front are whole
  // names.
  std::span<const std::string_view> extensions;
  // Whether a file that begins with `head` (its first kSniffBytes bytes, or all) is of this format. Null where the
  // format has no mark of its own: then the extension decides.
  bool (*sniff)(std::string_view head) = nullptr;
  // Whether a file without any mark is of this format all the same, by what its beginning says of the rest. Asked where
  // the name says a format that the file is not of. Null where `sniff` says it.
  bool (*looks_like)(const InputFile& file) = nullptr;
  // How many Gaussians there are, by the header alone. Null where that is not known before the file is read.
  Result<CloudExtent> (*extent)(const InputFile& file) = nullptr;
  // What the file says about itself beside its Gaussians. Null where there is nothing.
  Result<FormatFacts> (*describe)(const InputFile& file) = nullptr;
  // Bytes of the file and of those beside it that belong to it. Null: its own.
  uint64_t (*size)(const InputFile& file) = nullptr;
  // Null: recognised, but not read or not written by this version.
  Result<GaussianCloud> (*read)(const InputFile& file, const ReadLimits& limits) = nullptr;
  // The same to look at block by block, with memory for few of them; null inside where this file cannot be read so, as
  // where the format cannot. The file must outlive it.
  Result<std::unique_ptr<CloudBlocks>> (*blocks)(const InputFile& file, const ReadLimits& limits) = nullptr;
  // `read` and `write` with what a file says beside its Gaussians (extra_properties.h). Null where that has no place.
  Result<GaussianCloud> (*read_with_extras)(const InputFile& file, const ReadLimits& limits,
                                            ExtraProperties& extras) = nullptr;
  Status (*write)(const std::filesystem::path& path, const CloudView& cloud,
                  const CloudWriteOptions& options) = nullptr;
  Status (*write_with_extras)(const std::filesystem::path& path, const CloudView& cloud,
                              const CloudWriteOptions& options, const ExtraProperties& extras) = nullptr;
  // It says every value of a Gaussian as it is stored. Others get those that nobody draws without opacity
  // (hidden_rows.h), as what they can say of them might show.
  bool keeps_all_values = false;
  // Rows of the cloud in the order in which `write` puts them, where that is none of SplatOrder's and some may be left
  // out. Null: WriteOrder (splat_order.h).
  Buffer<uint32_t> (*written_rows)(const CloudView& cloud, const CloudWriteOptions& options) = nullptr;
  // It writes more than one file whatever its name, those of `written_beside` aside.
  bool several_files = false;
  // Files that `write` makes beside the one it is told. Null: none.
  std::vector<std::filesystem::path> (*written_beside)(const std::filesystem::path& path, int sh_degree) = nullptr;
  // Bytes of the file `write` makes of a cloud without comments. Null where nothing can be said.
  uint64_t (*predicted_size)(int64_t count, int sh_degree) = nullptr;
  // The prediction is what real splats take; values that compress better or worse take less or more.
  bool size_is_estimate = false;
  // Of writing one with SH of degree 3 on one core, about: for what is said before the work begins.
  double seconds_per_gaussian = 2e-7;
  // The order in which `write` puts Gaussians by default.
  SplatOrder order = SplatOrder::kKeep;
  // What the axes of its files are by its own convention.
  Axes axes = kRdf;
  // What they are in this file, where it may say so. Null: `axes`.
  Result<Axes> (*declared_axes)(const InputFile& file) = nullptr;
  FormatRange range = {};
  ModeTag mode_tag = ModeTag::kNone;
  CommentPlace comments = CommentPlace::kNone;
  bool keeps_origin = false;  // of the means (core/world_origin.h), or writes them in the world
  // Gaussians that `write` cannot place without making others coarser than they are worth (strays.h): they are written
  // without opacity. Null: it places all of them.
  Strays (*strays)(const CloudView& cloud) = nullptr;
  // A sentence where `write` must round the means of this cloud more coarsely than is usual, else nothing. May be null.
  std::string (*mean_loss)(const CloudView& cloud) = nullptr;
};

inline constexpr size_t kSniffBytes = 4096;

// All known formats; those with a more special mark first.
std::span<const SplatFormat> Formats();

// By content first and extension second; null when neither is known.
const SplatFormat* FormatOfFile(std::string_view head, const std::filesystem::path& path);
// The same of a file that is open, of which more can be asked. `name`: what tells its extension.
Result<const SplatFormat*> FormatOfFile(const InputFile& file, const std::filesystem::path& name);
const SplatFormat* FormatOfExtension(const std::filesystem::path& path);
// By what people write for one: "spz", ".spz", ".compressed.ply", "meta.json"; null for what is none.
const SplatFormat* FormatOfName(std::string_view name);

}  // namespace anchorsplat

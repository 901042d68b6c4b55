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

// Value range of a format, to which writers clamp: half a step beyond its extreme values.
struct FormatRange {
  int sh_degree = kMaxShDegree;
  float log_scale_min = -std::numeric_limits<float>::infinity();
  float log_scale_max = std::numeric_limits<float>::infinity();
  float dc = std::numeric_limits<float>::infinity();         // largest |f_dc|
  float harmonics = std::numeric_limits<float>::infinity();  // largest |coefficient| of degree 1–3
};

// What a format can record about the render mode.
enum class ModeTag {
  kNone,
  kCompensated,  // whether opacity is compensated, but not the dilation: read as kAntialiased
  kEach,
};

// Which comments of a splat a format stores.
enum class CommentPlace {
  kNone,
  kCredits,  // credits and full-width marks (core/splat_comments.h)
  kAll,
};

// A splat format: how to recognise it, and functions to read and write it. A new format is one file per direction and
// one row in registry.cc.
struct SplatFormat {
  std::string_view name;           // "PLY", in messages: "is a … file"
  std::string_view article = "a";  // indefinite article for the name as spoken
  // Lower case; the longest match wins: ".compressed.ply" before ".ply". Entries without a leading dot are whole names.
  std::span<const std::string_view> extensions;
  // Whether a file that starts with `head` (its first kSniffBytes bytes, or all) has this format. Null if the format
  // has no magic number: the extension decides.
  bool (*sniff)(std::string_view head) = nullptr;
  // Whether a file without magic number has this format judging by its values. Called if the name claims another
  // format. Null if `sniff` suffices.
  bool (*looks_like)(const InputFile& file) = nullptr;
  // Count and degree from the header alone. Null if unknown before reading.
  Result<CloudExtent> (*extent)(const InputFile& file) = nullptr;
  // Properties of the file besides its Gaussians. Null if there are none.
  Result<FormatFacts> (*describe)(const InputFile& file) = nullptr;
  // Bytes of the file and those that belong to it. Null: only the file.
  uint64_t (*size)(const InputFile& file) = nullptr;
  // Null: recognised, but not read (or not written) by this version.
  Result<GaussianCloud> (*read)(const InputFile& file, const ReadLimits& limits) = nullptr;
  // `read` block by block, with little memory. Null, or a null result, if the format or this file cannot be read so.
  // The file must outlive it.
  Result<std::unique_ptr<CloudBlocks>> (*blocks)(const InputFile& file, const ReadLimits& limits) = nullptr;
  // `read` and `write` with extra properties (extra_properties.h). Null if the format cannot store them.
  Result<GaussianCloud> (*read_with_extras)(const InputFile& file, const ReadLimits& limits,
                                            ExtraProperties& extras) = nullptr;
  Status (*write)(const std::filesystem::path& path, const CloudView& cloud,
                  const CloudWriteOptions& options) = nullptr;
  Status (*write_with_extras)(const std::filesystem::path& path, const CloudView& cloud,
                              const CloudWriteOptions& options, const ExtraProperties& extras) = nullptr;
  // Stores every value of a Gaussian exactly. Other formats write unusable Gaussians without opacity (hidden_rows.h),
  // as their approximations might be visible.
  bool keeps_all_values = false;
  // Rows of the cloud in the order of `write`, if that is not a SplatOrder or rows may be dropped. Null: WriteOrder
  // (splat_order.h).
  Buffer<uint32_t> (*written_rows)(const CloudView& cloud, const CloudWriteOptions& options) = nullptr;
  // Always writes several files, not counting `written_beside`.
  bool several_files = false;
  // Files that `write` creates beside `path`. Null: none.
  std::vector<std::filesystem::path> (*written_beside)(const std::filesystem::path& path, int sh_degree) = nullptr;
  // Bytes that `write` needs for a cloud without comments. Null if unpredictable.
  uint64_t (*predicted_size)(int64_t count, int sh_degree) = nullptr;
  // predicted_size is an estimate from real splats, as compression depends on the values.
  bool size_is_estimate = false;
  // Rough time to write a Gaussian with SH degree 3 on one core, for messages before the work.
  double seconds_per_gaussian = 2e-7;
  // Default order of `write`.
  SplatOrder order = SplatOrder::kKeep;
  // Axes by the format's convention.
  Axes axes = kRdf;
  // Axes declared by a file. Null: always `axes`.
  Result<Axes> (*declared_axes)(const InputFile& file) = nullptr;
  FormatRange range = {};
  ModeTag mode_tag = ModeTag::kNone;
  CommentPlace comments = CommentPlace::kNone;
  bool keeps_origin = false;  // stores the origin of means (core/world_origin.h), or world coordinates
  // Gaussians to write without opacity because placing them would coarsen others too much (strays.h). Null: none.
  Strays (*strays)(const CloudView& cloud) = nullptr;
  // A message if `write` must round the means of this cloud unusually coarsely, else empty. May be null.
  std::string (*mean_loss)(const CloudView& cloud) = nullptr;
};

inline constexpr size_t kSniffBytes = 4096;

// All known formats; those with a more specific magic number first.
std::span<const SplatFormat> Formats();

// Detects the format by content, then extension; null if unknown.
const SplatFormat* FormatOfFile(std::string_view head, const std::filesystem::path& path);
// The same for an open file, which allows more checks. `name` gives the extension.
Result<const SplatFormat*> FormatOfFile(const InputFile& file, const std::filesystem::path& name);
const SplatFormat* FormatOfExtension(const std::filesystem::path& path);
// Looks up a name as users write it: "spz", ".spz", ".compressed.ply", "meta.json"; null if unknown.
const SplatFormat* FormatOfName(std::string_view name);

}  // namespace anchorsplat

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/attribute_error.h"
#include "formats/axes.h"
#include "formats/cloud_io.h"
#include "formats/extra_properties.h"
#include "formats/opened_splat.h"
#include "formats/stored_as.h"

namespace anchorsplat {

struct SplatFormat;

struct ConvertOptions {
  const SplatFormat* input_format = nullptr;   // what the input is, whatever it looks like; null: found out
  std::optional<RenderMode> render_mode = {};  // what the output says, whatever the input did
  std::optional<int> sh_degree = {};           // higher coefficients are dropped, missing ones become zero
  float min_opacity = 0;                       // Gaussians below are dropped; 0–1
  std::optional<int64_t> max_gaussians = {};   // the ones of the largest size × opacity stay
  // What the axes of the files really are, where a program did not follow the format's own convention.
  std::optional<Axes> input_axes = {}, output_axes = {};
  StoredAs stored = {};  // what the input's numbers mean
  int lod_level = 0;     // of a streamed SOG that is read; 0 is the finest
  CloudWriteOptions write = {};
  bool double_means = false;  // of a PLY that is written
  bool measure = false;       // read the output back and compare
};

// "IN:OUT", "IN:" or ":OUT", or "IN" alone, each three letters as in AxesFromName: sets the axes of `options`.
// kBadArgument for anything else.
Status ParseAxes(std::string_view text, ConvertOptions& options);

struct ConvertReport {
  std::string input_format, output_format;
  int64_t gaussians_read = 0, gaussians_written = 0;
  int sh_degree_read = 0, sh_degree_written = 0;  // what the output really has
  uint64_t input_bytes = 0, output_bytes = 0;
  std::optional<uint64_t> predicted_bytes;
  bool predicted_roughly = false;  // from what real splats take
  double read_seconds = 0, write_seconds = 0;
  std::optional<AttributeError> error;  // when measured
};

// Reads, changes and writes. In one copy of the cloud, changed in place. Errors: those of ReadCloud and WriteCloud;
// kBadArgument when nothing is left to write or the output is the input. Gaussians without usable numbers are told in a
// warning. `kept` takes the cloud as it was written, for comparisons, if not null.
Result<ConvertReport> ConvertFile(const std::filesystem::path& input, const std::filesystem::path& output,
                                  const ConvertOptions& options, GaussianCloud* kept = nullptr);

// The two halves of it, for who does something else in between.
struct ConvertedSplat {
  GaussianCloud cloud;
  ExtraProperties extras;
  ConvertReport report;
};
// Reads one input and makes of its numbers and axes what the options say they are. `name`: of it, for messages.
Result<ConvertedSplat> ReadToConvert(const OpenedSplat& file, const std::string& name, const ConvertOptions& options);
// Turns to the output's axes, sorts, writes and, where asked, measures. `kept` as in ConvertFile.
Result<ConvertReport> WriteConverted(ConvertedSplat splat, const std::filesystem::path& output,
                                     const ConvertOptions& options, GaussianCloud* kept = nullptr);
// The format of a file that can be written, or the error of WriteCloud.
Result<const SplatFormat*> WrittenFormat(const std::filesystem::path& output, const ConvertOptions& options);
// How large a file of so many Gaussians like `head`, whose rows do not count, will be, where its format tells.
void PredictBytes(const SplatFormat& to, const CloudView& head, int64_t gaussians, const ExtraProperties& extras,
                  ConvertReport& report);
// Says how many Gaussians of an input nobody draws, where the output has them all the same.
void WarnOfUnusable(const SplatFormat& to, const std::string& name, const GaussianCloud& cloud);

// What WriteCloud has written there: in a folder or in memory, which has to outlive it.
Result<OpenedSplat> OpenWritten(const std::filesystem::path& output, const CloudWriteOptions& write);
// The same, read, for comparisons: positions of a format that keeps no origin are relative to that of `written`.
Result<GaussianCloud> ReadBack(const std::filesystem::path& output, const CloudWriteOptions& write,
                               const CloudView& written, ExtraProperties* extras = nullptr);

// The parts of it that change a cloud, in the order in which they are done. In place.
// `extras` are changed alike, if not null. Gaussians that nobody draws have no opacity to DropFaint and no importance.
void DropFaint(GaussianCloud& cloud, float min_opacity, ExtraProperties* extras = nullptr);
void KeepMostImportant(GaussianCloud& cloud, int64_t most, ExtraProperties* extras = nullptr);  // their order stays
void SetShDegree(GaussianCloud& cloud, int degree);
// The rows for which keep[i] is set; their order stays.
void KeepRows(GaussianCloud& cloud, ExtraProperties* extras, const std::vector<char>& keep);
// Row i becomes the old row rows[i]; a permutation.
void Reorder(GaussianCloud& cloud, const Buffer<uint32_t>& rows, ExtraProperties* extras = nullptr);

}  // namespace anchorsplat

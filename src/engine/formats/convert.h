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
  const SplatFormat* input_format = nullptr;   // forces the input's format; null: detect it
  std::optional<RenderMode> render_mode = {};  // overrides that of the input
  std::optional<int> sh_degree = {};           // drops higher coefficients, pads with zeros
  float min_opacity = 0;                       // drops Gaussians below; 0–1
  std::optional<int64_t> max_gaussians = {};   // keeps those with the largest size × opacity
  // Actual axes of the files, if a program did not follow the format's convention.
  std::optional<Axes> input_axes = {}, output_axes = {};
  StoredAs stored = {};  // meaning of the input's numbers
  int lod_level = 0;     // of a streamed SOG input; 0 is the finest
  CloudWriteOptions write = {};
  bool double_means = false;  // for PLY output
  bool measure = false;       // read the output back and compare
};

// Parses "IN:OUT", "IN:", ":OUT" or "IN", three letters each as in AxesFromName, into the axes of `options`.
// kBadArgument for anything else.
Status ParseAxes(std::string_view text, ConvertOptions& options);

struct ConvertReport {
  std::string input_format, output_format;
  int64_t gaussians_read = 0, gaussians_written = 0;
  int sh_degree_read = 0, sh_degree_written = 0;  // actual
  uint64_t input_bytes = 0, output_bytes = 0;
  std::optional<uint64_t> predicted_bytes;
  bool predicted_roughly = false;  // estimated from real splats
  double read_seconds = 0, write_seconds = 0;
  std::optional<AttributeError> error;  // when measured
};

// Reads, edits and writes a splat, with one copy of the cloud, edited in place. Warns of unusable Gaussians. `kept`, if
// given, receives the written cloud for comparison. Errors: those of ReadCloud and WriteCloud; kBadArgument: nothing
// left to write, or the output is the input.
Result<ConvertReport> ConvertFile(const std::filesystem::path& input, const std::filesystem::path& output,
                                  const ConvertOptions& options, GaussianCloud* kept = nullptr);

// The two halves of ConvertFile, for callers with steps in between.
struct ConvertedSplat {
  GaussianCloud cloud;
  ExtraProperties extras;
  ConvertReport report;
};
// Reads an input and applies the options about its numbers and axes. `name` is used in messages.
Result<ConvertedSplat> ReadToConvert(const OpenedSplat& file, const std::string& name, const ConvertOptions& options);
// Converts to the output's axes, sorts, writes and, if requested, measures. `kept`: see ConvertFile.
Result<ConvertReport> WriteConverted(ConvertedSplat splat, const std::filesystem::path& output,
                                     const ConvertOptions& options, GaussianCloud* kept = nullptr);
// The format for writing `output`, or the error of WriteCloud.
Result<const SplatFormat*> WrittenFormat(const std::filesystem::path& output, const ConvertOptions& options);
// Predicts the size of a file with `gaussians` rows like `head` (its own rows are ignored), if the format allows it.
void PredictBytes(const SplatFormat& to, const CloudView& head, int64_t gaussians, const ExtraProperties& extras,
                  ConvertReport& report);
// Warns of unusable Gaussians in an input that the output will contain.
void WarnOfUnusable(const SplatFormat& to, const std::string& name, const GaussianCloud& cloud);

// Opens what WriteCloud wrote, in a folder or in memory, which must outlive the result.
Result<OpenedSplat> OpenWritten(const std::filesystem::path& output, const CloudWriteOptions& write);
// The same, read for comparison: for formats without an origin, positions are relative to that of `written`.
Result<GaussianCloud> ReadBack(const std::filesystem::path& output, const CloudWriteOptions& write,
                               const CloudView& written, ExtraProperties* extras = nullptr);

// The edits of ConvertFile, in order, in place. `extras`, if given, are edited alike. Unusable Gaussians count as
// opacity and importance 0.
void DropFaint(GaussianCloud& cloud, float min_opacity, ExtraProperties* extras = nullptr);
void KeepMostImportant(GaussianCloud& cloud, int64_t most, ExtraProperties* extras = nullptr);  // keeps their order
void SetShDegree(GaussianCloud& cloud, int degree);
// Keeps rows with keep[i] set, in order.
void KeepRows(GaussianCloud& cloud, ExtraProperties* extras, const std::vector<char>& keep);
// Moves old row rows[i] to row i; `rows` is a permutation.
void Reorder(GaussianCloud& cloud, const Buffer<uint32_t>& rows, ExtraProperties* extras = nullptr);

}  // namespace anchorsplat

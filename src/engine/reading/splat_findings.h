#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "core/statistics.h"
#include "formats/opened_splat.h"
#include "reading/treatment.h"

namespace anchorsplat {

// What a splat is and what may be wrong with it, as shown by `info`.
struct SplatFindings {
  std::string file;    // empty: a splat in memory
  std::string format;  // by content
  FormatFacts facts;
  uint64_t file_bytes = 0;
  std::optional<RenderMode> render_mode;  // as the file says
  std::vector<std::string> comments;
  WorldOrigin origin = {0, 0, 0};  // of the means
  bool lost_no_width = false;      // IsMarkedFullWidth (core/splat_comments.h)
  CloudStatistics statistics;
  Result<Reading> reading = Error{};  // of the visible Gaussians
  Treatment treatment;                // what `enhance` would do by default, at kInfoUpscale
  std::vector<std::string> problems;  // sentences
};

inline constexpr double kInfoUpscale = 4;  // the default zoom of `enhance`

// The splat's provenance, "a classic splat (98 %)", and what `enhance` would do, "a network at pixels of 0.01, for 3.1
// dB at 4x".
std::string DescribeProvenance(const SplatFindings& findings);
std::string TreatmentInWords(const SplatFindings& findings);

// `name` is the file's, for people. The same numbers with any number of threads, whatever of the file is in memory.
// Errors: of reading.
Result<SplatFindings> InspectSplat(const OpenedSplat& file, const std::string& name);
// Of a splat in memory: without format and size of a file.
SplatFindings InspectSplat(const CloudView& cloud);

}  // namespace anchorsplat

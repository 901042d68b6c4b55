#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/cloud_blocks.h"
#include "core/cloud_view.h"
#include "core/result.h"
#include "core/statistics.h"
#include "formats/opened_splat.h"
#include "reading/treatment.h"

namespace anchorsplat {

// What `info` tells, once for people and once as JSON.
struct SplatFindings {
  std::string file;    // empty: a splat in memory
  std::string format;  // by content
  FormatFacts facts;
  uint64_t file_bytes = 0;
  std::optional<RenderMode> render_mode;  // as the file says
  std::vector<std::string> comments;
  WorldOrigin origin = {0, 0, 0};  // of the means
  bool lost_no_width = false;      // HasLostNoWidth (core/splat_comments.h)
  CloudStatistics statistics;
  Result<Reading> reading = Error{};  // of what shows
  Treatment treatment;                // what `enhance` would do by itself, at kInfoUpscale
  std::vector<std::string> problems;  // sentences
};

inline constexpr double kInfoUpscale = 4;  // the default zoom of `enhance`

// What it looks like and what `enhance` would do about it: "a classic splat (98 %)"; "a network at pixels of 0.01, for
// 3.1 dB at 4x".
std::string LooksInWords(const SplatFindings& findings);
std::string TreatmentInWords(const SplatFindings& findings);

// `name` is the file's, for people. The same numbers with any number of threads, whatever of the file is in memory.
// Errors: of reading.
Result<SplatFindings> InspectSplat(const OpenedSplat& file, const std::string& name);
// Of a splat in memory: without format and size of a file.
SplatFindings InspectSplat(const CloudView& cloud);
nlohmann::json ToJson(const SplatFindings& findings);
nlohmann::json ToJson(const Reading& reading);

// What is in a network's weights.
struct NetworkFindings {
  std::string file;
  std::map<std::string, std::string> facts;  // the file's metadata and the architecture
  size_t tensors = 0;
  int64_t parameters = 0;  // learned numbers
};

// By content: gsplat keeps splats in files of the same kind, and other formats are zip archives too.
bool LooksLikeNetwork(const std::filesystem::path& path);
Result<NetworkFindings> InspectNetwork(const std::string& path);
nlohmann::json ToJson(const NetworkFindings& findings);

}  // namespace anchorsplat

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
#include "enhance/lost_width.h"
#include "enhance/pixel_size_guard.h"
#include "enhance/pixel_sizes_of_things.h"
#include "enhance/trained_kind.h"
#include "formats/opened_splat.h"

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
  bool lost_no_width = false;      // HasLostNoWidth (enhance/enhanced_mark.h)
  CloudStatistics statistics;
  Result<PixelSizeFinding> pixel_size = Error{};
  double share_for_network = 1;        // ShareForNetwork
  std::vector<ThingPixelSize> things;  // that lie apart and have each a pixel size of their own; mostly none
  std::optional<TrainedKind> looks;   // by its sizes, whatever the file says; nothing where there are too few Gaussians
  LostWidth lost_width;               // at kInfoUpscale, as `enhance` gives it back
  std::vector<std::string> problems;  // sentences
};

inline constexpr double kInfoUpscale = 4;  // the default zoom of `enhance`

// Ends of sentences. "It looks like a classic one"; "lost width: 0.73 of 0.3 px² at 4x (likely)", with what `enhance`
// would do about it.
std::string_view InWords(const std::optional<TrainedKind>& looks);
std::string LostWidthInWords(const SplatFindings& findings);

// `name` is the file's, for people. The same numbers with any number of threads, whatever of the file is in memory.
// Errors: of reading.
Result<SplatFindings> InspectSplat(const OpenedSplat& file, const std::string& name);
// Of a splat in memory: without format and size of a file.
SplatFindings InspectSplat(const CloudView& cloud);
nlohmann::json ToJson(const SplatFindings& findings);
nlohmann::json ToJson(std::span<const ThingPixelSize> things);

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

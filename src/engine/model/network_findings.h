#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "core/result.h"

namespace anchorsplat {

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

}  // namespace anchorsplat

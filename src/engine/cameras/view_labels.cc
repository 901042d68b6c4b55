#include "cameras/view_labels.h"

#include <algorithm>
#include <set>

#include "cameras/camera_checks.h"

namespace anchorsplat {

std::vector<std::string> ViewParts(const std::string& name) {
  std::vector<std::string> parts;
  const std::string path = ViewName(name);
  for (size_t begin = 0; begin <= path.size();) {
    const size_t end = std::min(path.find('/', begin), path.size());
    std::string part = path.substr(begin, end - begin);
    if (!part.empty() && part != "." && part != "..") parts.push_back(std::move(part));
    begin = end + 1;
  }
  return parts;
}

std::vector<std::string> ViewLabels(std::span<const std::string> names) {
  std::vector<std::vector<std::string>> parts;
  std::set<std::string> last;
  size_t common = names.empty() ? 0 : ViewParts(names[0]).size();
  for (const std::string& name : names) {
    const auto& own = parts.emplace_back(ViewParts(name));
    last.insert(own.empty() ? "" : own.back());
    const size_t folders = own.empty() ? 0 : own.size() - 1;
    common = std::min(common, folders);
    while (common > 0 && !std::equal(own.begin(), own.begin() + static_cast<ptrdiff_t>(common), parts[0].begin())) {
      --common;
    }
  }
  const bool apart = last.size() == names.size();
  std::vector<std::string> labels;
  for (const auto& own : parts) {
    std::string label;
    for (size_t k = apart ? own.size() - std::min<size_t>(own.size(), 1) : common; k < own.size(); ++k) {
      label += (label.empty() ? "" : "/") + own[k];
    }
    labels.push_back(std::move(label));
  }
  return labels;
}

}  // namespace anchorsplat

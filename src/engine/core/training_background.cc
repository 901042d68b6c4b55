#include "core/training_background.h"

#include <algorithm>
#include <string_view>
#include <system_error>

#include "core/number_text.h"
#include "core/text.h"

namespace anchorsplat {

namespace {
constexpr std::string_view kBackgroundMark = "trained over: ";

std::optional<std::array<float, 3>> ParseBackground(std::string_view text) {
  if (!text.starts_with(kBackgroundMark)) return std::nullopt;
  text.remove_prefix(kBackgroundMark.size());
  std::array<float, 3> background{};
  for (float& channel : background) {
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    double value = 0;
    const auto [end, code] = FromChars(text.data(), text.data() + text.size(), value);
    if (code != std::errc() || !(value >= 0 && value <= 1)) return std::nullopt;
    channel = static_cast<float>(value);
    text.remove_prefix(static_cast<size_t>(end - text.data()));
  }
  return text.empty() ? std::optional(background) : std::nullopt;
}

}  // namespace

std::string BackgroundComment(const std::array<float, 3>& background) {
  return Cat(kBackgroundMark, background[0], " ", background[1], " ", background[2]);
}

std::optional<std::array<float, 3>> BackgroundOf(const std::vector<std::string>& comments) {
  for (const std::string& comment : comments) {
    if (const auto background = ParseBackground(comment)) return background;
  }
  return std::nullopt;
}

}  // namespace anchorsplat

#include "core/splat_comments.h"

#include <algorithm>
#include <cctype>
#include <system_error>

#include "core/number_text.h"
#include "core/text.h"
#include "core/vector3.h"
#include "core/words.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<double, 3>;

constexpr std::string_view kUpMark = "world up: ";
constexpr std::string_view kVerticalAxis = "vertical axis:";

std::string EnhancementWords(const std::string& method, double upscale, bool invented) {
  return Cat(method, ", ", upscale, " times closer", invented ? ", detail invented" : "");
}

constexpr std::string_view kCreditMark = "credit: ";

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

// Parses three numbers separated and surrounded by `between` characters.
std::optional<Vec3> ThreeNumbers(std::string_view text, std::string_view between) {
  const auto skip = [&] { text.remove_prefix(std::min(text.find_first_not_of(between), text.size())); };
  Vec3 numbers{};
  for (double& x : numbers) {
    skip();
    const auto [end, code] = FromChars(text.data(), text.data() + text.size(), x);
    if (code != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
  }
  skip();
  return text.empty() ? UnitVector(numbers, 0) : std::nullopt;
}

std::optional<Vec3> OwnUp(std::string_view text) {
  return text.starts_with(kUpMark) ? ThreeNumbers(text.substr(kUpMark.size()), " ") : std::nullopt;
}

// Text after "vertical axis:", in any case; none in other comments.
std::optional<std::string> VerticalAxis(std::string_view text) {
  if (text.size() < kVerticalAxis.size()) return std::nullopt;
  std::string small(text);
  for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (!small.starts_with(kVerticalAxis)) return std::nullopt;
  small.erase(0, kVerticalAxis.size());
  while (!small.empty() && small.back() == ' ') small.pop_back();
  small.erase(0, std::min(small.find_first_not_of(' '), small.size()));
  return small;
}

std::optional<Vec3> OthersUp(std::string_view text) {
  const std::optional<std::string> said = VerticalAxis(text);
  if (!said || *said == "y") return std::nullopt;
  const bool has_sign = said->size() == 2 && (said->front() == '-' || said->front() == '+');
  if (said->size() == 1 || has_sign) {
    const size_t axis = std::string_view("xyz").find(said->back());
    if (axis > 2) return std::nullopt;
    Vec3 up{};
    up[axis] = said->front() == '-' ? -1 : 1;
    return up;
  }
  return ThreeNumbers(*said, " ,[]()");
}

}  // namespace

bool IsMark(std::string_view comment) {
  return comment.starts_with(kEnhancedMark) || comment.starts_with(kPartEnhancedMark) ||
         comment.starts_with(kPixelAreaMark);
}

bool HasMark(std::span<const std::string> comments, std::string_view mark) {
  return std::ranges::any_of(comments, [&](const std::string& comment) { return comment.starts_with(mark); });
}

std::string EnhancedComment(const std::string& method, double upscale, bool invented) {
  return Cat(kEnhancedMark, EnhancementWords(method, upscale, invented));
}

bool IsMarkedEnhanced(const CloudView& cloud) { return HasMark(cloud.comments, kEnhancedMark); }

std::string PartEnhancedComment(const std::string& method, double upscale, bool invented) {
  return Cat(kPartEnhancedMark, EnhancementWords(method, upscale, invented));
}

bool IsMarkedPartEnhanced(const CloudView& cloud) { return HasMark(cloud.comments, kPartEnhancedMark); }

std::string PixelAreaComment(double upscale) { return Cat(kPixelAreaMark, upscale, " times closer"); }

bool IsFittedToPixelAreas(const CloudView& cloud) { return HasMark(cloud.comments, kPixelAreaMark); }

bool IsMarkedFullWidth(const CloudView& cloud) {
  return IsFittedToPixelAreas(cloud) || IsMarkedEnhanced(cloud) || IsMarkedPartEnhanced(cloud);
}

std::vector<std::string> CreditsOf(std::span<const std::string> comments) {
  std::vector<std::string> credits;
  for (const std::string& comment : comments) {
    if (comment.starts_with(kCreditMark) && comment.size() > kCreditMark.size()) {
      credits.push_back(comment.substr(kCreditMark.size()));
    }
  }
  return credits;
}

std::string CopyrightOf(std::span<const std::string> comments) {
  std::string text;
  for (const std::string& credit : CreditsOf(comments)) text += (text.empty() ? "" : "\n") + credit;
  return text;
}

std::vector<std::string> CommentsOfCopyright(std::string_view copyright) {
  std::vector<std::string> comments;
  while (!copyright.empty()) {
    const size_t end = std::min(copyright.find_first_of("\r\n"), copyright.size());
    const std::string_view line = Trimmed(copyright.substr(0, end));
    if (!line.empty()) comments.push_back(Cat(kCreditMark, line));
    copyright.remove_prefix(std::min(end + 1, copyright.size()));
  }
  return comments;
}

std::string BackgroundComment(const std::array<float, 3>& background) {
  return Cat(kBackgroundMark, background[0], " ", background[1], " ", background[2]);
}

std::optional<std::array<float, 3>> BackgroundOf(const std::vector<std::string>& comments) {
  for (const std::string& comment : comments) {
    if (const auto background = ParseBackground(comment)) return background;
  }
  return std::nullopt;
}

std::string UpComment(const Vec3& up) { return Cat(kUpMark, up[0], " ", up[1], " ", up[2]); }

std::optional<Vec3> UpOf(const std::vector<std::string>& comments) {
  for (const auto parse : {OwnUp, OthersUp}) {
    for (const std::string& comment : comments) {
      if (const auto up = parse(comment)) return up;
    }
  }
  return std::nullopt;
}

void SetUp(const Vec3& up, std::vector<std::string>& comments) {
  std::erase_if(comments, [](const std::string& text) { return text.starts_with(kUpMark) || VerticalAxis(text); });
  comments.push_back(UpComment(up));
}

void TurnUpComments(const std::array<double, 9>& m, std::vector<std::string>& comments) {
  for (std::string& comment : comments) {
    const auto own = OwnUp(comment);
    const auto up = own ? own : OthersUp(comment);
    if (!up) continue;
    Vec3 turned{};
    for (size_t k = 0; k < 3; ++k) {
      turned[k] = m[3 * k] * (*up)[0] + m[3 * k + 1] * (*up)[1] + m[3 * k + 2] * (*up)[2];
      if (turned[k] == 0) turned[k] = 0;  // avoid printing −0
    }
    comment = UpComment(turned);
  }
  // An unsigned axis is meaningless once it may have become another one.
  const bool same_axis = m[4] != 0;
  if (!same_axis) std::erase_if(comments, [](const std::string& comment) { return VerticalAxis(comment) == "y"; });
}

}  // namespace anchorsplat

#include "formats/ply/render_mode_tag.h"

#include <cmath>

#include "core/ascii_lower_case.h"
#include "core/number_text.h"
#include "core/text.h"
#include "core/words.h"

namespace anchorsplat {

namespace {

constexpr std::string_view kModeKey = "splatrendermode:";
constexpr std::string_view kDilationKey = "splatrenderdilation:";
constexpr std::string_view kBrushKey = "exported from brush";

std::optional<double> PositiveNumber(std::string_view text) {
  double value = 0;
  const auto [end, error] = FromChars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value > 0) || !std::isfinite(value)) return {};
  return value;
}

}  // namespace

bool RenderModeTag::Take(std::string_view comment) {
  const std::string lower = AsciiLowerCase(std::string(comment));
  std::string_view rest = Trimmed(lower);
  Word word = Word::kNone;
  if (rest.starts_with(kModeKey)) {
    rest = Trimmed(rest.substr(kModeKey.size()));
    word = rest == "mip" ? Word::kMip : rest == "default" ? Word::kDefault : Word::kNone;
  } else if (rest.starts_with(kDilationKey)) {
    const auto value = PositiveNumber(Trimmed(rest.substr(kDilationKey.size())));
    if (value) dilation_ = value;
    return value.has_value();
  } else if (rest.starts_with(kBrushKey)) {
    by_brush_ = true;
  } else if (TakeWord(rest) == "antialiased") {
    word = rest == "1" ? Word::kAntialiased : rest == "0" ? Word::kDefault : Word::kNone;
  }
  if (word != Word::kNone) last_ = word;
  return word != Word::kNone;
}

std::optional<RenderMode> RenderModeTag::mode() const {
  switch (last_) {
    case Word::kDefault:
      return RenderMode::kClassic;
    case Word::kAntialiased:
      return RenderMode::kAntialiased;
    case Word::kMip: {
      if (!dilation_) return by_brush_ ? RenderMode::kMip : RenderMode::kAntialiased;
      // The nearer one of two.
      constexpr double kMiddle = 0.5 * (double{DilationOf(RenderMode::kMip)} + DilationOf(RenderMode::kAntialiased));
      return *dilation_ < kMiddle ? RenderMode::kMip : RenderMode::kAntialiased;
    }
    default:
      return std::nullopt;
  }
}

bool LooksLikeModeTag(std::string_view comment) {
  const std::string lower = AsciiLowerCase(std::string(comment));
  std::string_view rest = Trimmed(lower);
  if (rest.starts_with(kModeKey) || rest.starts_with(kDilationKey)) return true;
  // More than one word is prose.
  return TakeWord(rest) == "antialiased" && !rest.empty() && rest.find_first_of(" \t") == rest.npos;
}

std::vector<std::string> CommentsOf(RenderMode mode) {
  if (!IsCompensated(mode)) return {"SplatRenderMode: default"};
  return {"SplatRenderMode: mip", Cat("SplatRenderDilation: ", DilationOf(mode))};
}

}  // namespace anchorsplat

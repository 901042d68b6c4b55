#include "formats/json_asset.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "core/log.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "io/size_limit.h"

namespace anchorsplat {

namespace {

// Other contents belong to other programs.
void AddMarks(const JsonValue& asset, std::vector<std::string>& comments) {
  constexpr size_t kMost = 16, kMostBytes = 1000;
  const std::optional<JsonValue> extras = asset.Find("extras");
  const std::optional<JsonValue> list = extras ? extras->Find("comments") : std::nullopt;
  if (!list || !list->raw().is_array()) return;
  size_t marks = 0;
  for (const nlohmann::json& one : list->raw()) {
    if (!one.is_string() || marks == kMost) continue;
    const auto& text = one.get_ref<const std::string&>();
    if (text.size() > kMostBytes || !(IsMark(text) || OriginOfComment(text) || UpOf({text}))) continue;
    comments.push_back(text);
    ++marks;
  }
}

}  // namespace

nlohmann::json AssetOf(std::span<const std::string> comments, const WorldOrigin& origin) {
  nlohmann::json asset = {{"generator", "anchorsplat " ANCHORSPLAT_VERSION}};
  // Comments are bytes, JSON is UTF-8.
  const auto in_utf8 = [](const std::string& text) {
    return nlohmann::json::parse(nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  };
  if (const std::string copyright = CopyrightOf(comments); !copyright.empty()) asset["copyright"] = in_utf8(copyright);
  for (const std::string& comment : comments) {
    if (IsMark(comment)) asset["extras"]["comments"].push_back(in_utf8(comment));
  }
  if (const auto up = UpOf({comments.begin(), comments.end()})) asset["extras"]["comments"].push_back(UpComment(*up));
  if (!IsZero(origin)) asset["extras"]["comments"].push_back(OriginComment(origin));
  return asset;
}

Result<std::vector<std::string>> CommentsOfAsset(const JsonValue& root) {
  constexpr size_t kMostBytes = size_t{1} << 20;  // the same limit as for a PLY header
  const std::optional<JsonValue> asset = root.Find("asset");
  std::vector<std::string> comments;
  if (!asset) return comments;
  if (const std::optional<JsonValue> copyright = asset->Find("copyright"); copyright && copyright->raw().is_string()) {
    const auto& text = copyright->raw().get_ref<const std::string&>();
    if (text.size() > kMostBytes) {
      return copyright->Complain(Cat("is ", MoreThanLimit(text.size(), kMostBytes, " of text")));
    }
    comments = CommentsOfCopyright(text);
  }
  AddMarks(*asset, comments);
  return comments;
}

std::vector<std::string> OtherEntries(const JsonValue& root, std::span<const std::string_view> known) {
  std::vector<std::string> others;
  if (!root.raw().is_object()) return others;
  for (const auto& [name, value] : root.raw().items()) {
    if (std::ranges::find(known, name) == known.end()) others.push_back(name);
  }
  return others;
}

void WarnOfAxisEntries(const std::string& file, std::span<const std::string> others) {
  constexpr std::array<std::string_view, 7> kWords = {"axis",   "axes",     "coord", "transform",
                                                      "matrix", "rotation", "frame"};
  for (const std::string& name : others) {
    std::string small = name;
    for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    const auto has = [&small](std::string_view word) { return small.find(word) != small.npos; };
    if (!small.starts_with("up") && std::ranges::none_of(kWords, has)) continue;
    LogWarning(Cat(file, ": ignoring the entry \"", Printable(name),
                   "\", which its format does not define; set the axes with convert --coords"));
  }
}

}  // namespace anchorsplat

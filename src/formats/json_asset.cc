#include "formats/json_asset.h"

#include <nlohmann/json.hpp>
#include <optional>

#include "core/credit.h"
#include "core/text.h"

namespace anchorsplat {

nlohmann::json AssetOf(std::span<const std::string> comments) {
  nlohmann::json asset = {{"generator", "anchorsplat " ANCHORSPLAT_VERSION}};
  const std::string copyright = CopyrightOf(comments);
  if (copyright.empty()) return asset;
  // Comments are bytes, JSON is UTF-8.
  const auto replace = nlohmann::json::error_handler_t::replace;
  asset["copyright"] = nlohmann::json::parse(nlohmann::json(copyright).dump(-1, ' ', false, replace));
  return asset;
}

Result<std::vector<std::string>> CommentsOfAsset(const JsonValue& root) {
  constexpr size_t kMostBytes = size_t{1} << 20;  // as much as the header of a PLY may have
  const std::optional<JsonValue> asset = root.Find("asset");
  const std::optional<JsonValue> copyright = asset ? asset->Find("copyright") : std::nullopt;
  if (!copyright || !copyright->raw().is_string()) return std::vector<std::string>();
  const auto& text = copyright->raw().get_ref<const std::string&>();
  if (text.size() > kMostBytes) {
    return copyright->Complain(Cat("is a text of ", HumanBytes(text.size()), ", longer than ", HumanBytes(kMostBytes)));
  }
  return CommentsOfCopyright(text);
}

}  // namespace anchorsplat

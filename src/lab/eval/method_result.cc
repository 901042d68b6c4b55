#include "eval/method_result.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "io/json_file.h"

namespace anchorsplat {

namespace {

template <typename Member>
double Mean(const std::vector<ViewScore>& views, Member member) {
  double sum = 0;
  for (const ViewScore& view : views) sum += member(view);
  return sum / static_cast<double>(views.size());
}

nlohmann::json ToJson(const ViewScore& view) {
  nlohmann::json json = {{"name", view.name}, {"ssim", view.ssim}, {"psnr", FiniteOrNull(view.psnr)}};
  if (view.lpips) json["lpips"] = *view.lpips;
  return json;
}

Result<ViewScore> ReadView(const JsonValue& json) {
  ViewScore view;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue name, json.Get("name"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(view.name, name.Text());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue psnr, json.Get("psnr"));
  view.psnr = std::numeric_limits<double>::infinity();
  if (!psnr.raw().is_null()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(view.psnr, psnr.Number());
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue ssim, json.Get("ssim"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(view.ssim, ssim.Number());
  if (const auto lpips = json.Find("lpips")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(view.lpips, lpips->Number());
  }
  return view;
}

Result<FactValue> ReadFact(const JsonValue& json, const char* key) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  if (value.raw().is_boolean()) return FactValue(value.raw().get<bool>());
  if (value.raw().is_number_integer()) return FactValue(value.raw().get<int64_t>());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double number, value.Number());
  return FactValue(number);
}

Result<double> ReadNumber(const JsonValue& json, const char* key) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  return value.Number();
}

Result<std::optional<MethodResult>> Read(const std::filesystem::path& path, const std::string& key) {
  RecordOwnFile(path);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile file, JsonFile::Read(path));
  const JsonValue root = file.root();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue said, root.Get("key"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, said.Text());
  if (text != key) return std::optional<MethodResult>();
  MethodResult result;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue object, root.Get("object"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(result.object, object.Text());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue method, root.Get("method"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(result.method, method.Text());
  ANCHORSPLAT_ASSIGN_OR_RETURN(result.seconds, ReadNumber(root, "seconds"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(result.render_seconds, ReadNumber(root, "render_seconds"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue gaussians, root.Get("gaussians"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(result.gaussians, gaussians.WholeNumber(0, std::numeric_limits<int>::max()));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue views, root.Get("views"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> elements, views.Elements());
  for (const JsonValue& element : elements) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(ViewScore view, ReadView(element));
    result.views.push_back(std::move(view));
  }
  if (result.views.empty()) return views.Complain("no views");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue facts, root.Get("facts"));
  for (const auto& [name, value] : facts.raw().items()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(result.facts[name], ReadFact(facts, name.c_str()));
  }
  return std::optional(std::move(result));
}

}  // namespace

double MethodResult::MeanPsnr() const {
  return Mean(views, [](const ViewScore& view) { return view.psnr; });
}

double MethodResult::MeanSsim() const {
  return Mean(views, [](const ViewScore& view) { return view.ssim; });
}

std::optional<double> MethodResult::MeanLpips() const {
  for (const ViewScore& view : views) {
    if (!view.lpips) return std::nullopt;
  }
  return Mean(views, [](const ViewScore& view) { return *view.lpips; });
}

std::optional<MethodResult> ReadMethodResult(const std::filesystem::path& path, const std::string& key) {
  auto result = Read(path, key);
  return result.ok() ? *std::move(result) : std::nullopt;
}

Status WriteMethodResult(const std::filesystem::path& path, const std::string& key, const MethodResult& result) {
  nlohmann::json json = {{"key", key},
                         {"object", result.object},
                         {"method", result.method},
                         {"seconds", result.seconds},
                         {"render_seconds", result.render_seconds},
                         {"gaussians", result.gaussians},
                         {"facts", nlohmann::json::object()},
                         {"views", nlohmann::json::array()}};
  for (const auto& [name, value] : result.facts) {
    std::visit([&, &fact = name](auto told) { json["facts"][fact] = told; }, value);
  }
  for (const ViewScore& view : result.views) json["views"].push_back(ToJson(view));
  return WriteWholeFile(path, json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n", true);
}

}  // namespace anchorsplat

#include "dataset/object_record.h"

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/file_system.h"
#include "core/text.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr uint64_t kMaxManifestBytes = uint64_t{1} << 30;  // a million objects

// Serialises a line; file names are bytes, so invalid UTF-8 is replaced.
std::string Line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"; }

Status TakeText(const JsonValue& json, const char* key, std::string& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  ANCHORSPLAT_ASSIGN_OR_RETURN(out, value.Text());
  return {};
}

Status TakeNumber(const JsonValue& json, const char* key, double& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  ANCHORSPLAT_ASSIGN_OR_RETURN(out, value.Number());
  return {};
}

Status TakeCount(const JsonValue& json, const char* key, int64_t& out) {
  double number = 0;
  ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(json, key, number));
  if (!(number >= 0 && number < 1e15)) return json.Complain(Cat("\"", key, "\" is not a count: ", number));
  out = static_cast<int64_t>(number);
  return {};
}

// Whether a name from a manifest is just a folder of the data set: manifests may come from anywhere.
bool IsFolderName(const std::string& name) {
  return !name.empty() && name != "." && name != ".." && name.find('/') == std::string::npos &&
         name.find('\0') == std::string::npos;
}

// Calls `take` for every non-empty line of one of the data set's lists.
Status ForEachLine(const fs::path& path, const std::function<Status(const JsonValue&)>& take) {
  RecordOwnFile(path);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path, kMaxManifestBytes));
  int64_t number = 0;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line = std::string_view(text).substr(at, end - at);
    at = end + 1;
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile json, JsonFile::Parse(Cat(path.string(), ": line ", number), line));
    ANCHORSPLAT_RETURN_IF_ERROR(take(json.root()));
  }
  return {};
}

}  // namespace

Json ToJson(const ObjectRecord& r) {
  return {{"name", r.name},
          {"source", r.source},
          {"recipe", r.recipe},
          {"title", r.origin.name},
          {"category", r.origin.category},
          {"creator", r.origin.creator},
          {"licence", r.origin.licence},
          {"licence_source", r.origin.licence_source},
          {"stem", r.stem},
          {"fingerprint", r.fingerprint},
          {"settings", ToJson(r.settings)},
          {"views", r.views},
          {"low_size", r.low_size},
          {"high_size", r.high_size},
          {"background", r.background},
          {"triangles", r.triangles},
          {"textures", r.textures},
          {"transparent_triangles", r.transparent_triangles},
          {"initial_points", r.initial_points},
          {"gaussians", r.gaussians},
          {"train_psnr", r.train_psnr},
          {"train_ssim", r.train_ssim},
          {"held_out_psnr", r.held_out_psnr},
          {"held_out_ssim", r.held_out_ssim},
          {"rejected", r.rejected},
          {"reason", r.reason},
          {"seconds", {{"read", r.read_seconds}, {"views", r.view_seconds}, {"fit", r.fit_seconds}}}};
}

Result<ObjectRecord> ObjectRecordFrom(const JsonValue& json) {
  ObjectRecord r;
  for (const auto& [key, text] :
       std::initializer_list<std::pair<const char*, std::string*>>{{"name", &r.name},
                                                                   {"source", &r.source},
                                                                   {"recipe", &r.recipe},
                                                                   {"title", &r.origin.name},
                                                                   {"category", &r.origin.category},
                                                                   {"creator", &r.origin.creator},
                                                                   {"licence", &r.origin.licence},
                                                                   {"licence_source", &r.origin.licence_source},
                                                                   {"stem", &r.stem},
                                                                   {"fingerprint", &r.fingerprint},
                                                                   {"reason", &r.reason}}) {
    ANCHORSPLAT_RETURN_IF_ERROR(TakeText(json, key, *text));
  }
  if (!IsFolderName(r.name)) return json.Complain(Cat("\"", Printable(r.name), "\" is not a folder name"));
  for (const auto& [key, count] :
       std::initializer_list<std::pair<const char*, int64_t*>>{{"triangles", &r.triangles},
                                                               {"textures", &r.textures},
                                                               {"transparent_triangles", &r.transparent_triangles},
                                                               {"initial_points", &r.initial_points},
                                                               {"gaussians", &r.gaussians}}) {
    ANCHORSPLAT_RETURN_IF_ERROR(TakeCount(json, key, *count));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue seconds, json.Get("seconds"));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(json, "train_psnr", r.train_psnr));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(json, "train_ssim", r.train_ssim));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(json, "held_out_psnr", r.held_out_psnr));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(json, "held_out_ssim", r.held_out_ssim));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(seconds, "read", r.read_seconds));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(seconds, "views", r.view_seconds));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(seconds, "fit", r.fit_seconds));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue rejected, json.Get("rejected"));
  if (!rejected.raw().is_boolean()) return rejected.Complain("expected true or false");
  r.rejected = rejected.raw().get<bool>();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue settings, json.Get("settings"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(r.settings, ObjectSettingsFrom(settings));
  // Records of early versions have these only in the settings.
  const ViewSetOptions& views = r.settings.views;
  r.views = views.rig.views;
  r.low_size = views.low_size;
  r.high_size = views.high_size;
  r.background = views.background;
  for (const auto& [key, number] : std::initializer_list<std::pair<const char*, int*>>{
           {"views", &r.views}, {"low_size", &r.low_size}, {"high_size", &r.high_size}}) {
    const auto value = json.Find(key);
    if (!value) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(*number, value->WholeNumber(1, 1 << 24));
  }
  if (const auto background = json.Find("background")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto rgb, background->Numbers(3));
    for (size_t k = 0; k < 3; ++k) r.background[k] = static_cast<float>(rgb[k]);
  }
  return r;
}

Result<Manifest> ReadManifest(const fs::path& dataset) {
  const fs::path path = dataset / kManifestName;
  Manifest manifest;
  const auto take = [&](const JsonValue& json) -> Status {
    ANCHORSPLAT_ASSIGN_OR_RETURN(ObjectRecord record, ObjectRecordFrom(json));
    const std::string name = record.name;
    if (!manifest.emplace(name, std::move(record)).second) {
      return json.Complain(Cat("object ", name, " is listed twice"));
    }
    return {};
  };
  ANCHORSPLAT_RETURN_IF_ERROR(ForEachLine(path, take));
  return manifest;
}

Status WriteManifest(const fs::path& dataset, const Manifest& manifest) {
  std::string text;
  for (const auto& [name, record] : manifest) text += Line(ToJson(record));
  return WriteWholeFile(dataset / kManifestName, text, true);
}

Result<Manifest> CollectRecords(const fs::path& dataset) {
  Manifest manifest;
  std::error_code code;
  for (fs::directory_iterator it(dataset, code), end; !code && it != end; it.increment(code)) {
    const fs::path path = it->path() / kRecordName;
    if (it->path().filename().string().starts_with(".") || !IsFile(path)) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile json, JsonFile::Read(path));
    ANCHORSPLAT_ASSIGN_OR_RETURN(ObjectRecord record, ObjectRecordFrom(json.root()));
    if (record.name != it->path().filename().string()) {
      return json.root().Complain(Cat("describes ", Printable(record.name), ", not the folder it is in"));
    }
    manifest.emplace(record.name, std::move(record));
  }
  if (code) return Error{ErrorCode::kIo, Cat(dataset.string(), ": ", code.message())};
  return manifest;
}

Status WriteFailures(const fs::path& dataset, const std::vector<ObjectFailure>& failures) {
  std::string text;
  for (const ObjectFailure& f : failures) {
    text += Line({{"name", f.name}, {"source", f.source}, {"stage", f.stage}, {"message", f.message}});
  }
  return WriteWholeFile(dataset / kFailuresName, text, true);
}

Result<std::vector<ObjectFailure>> ReadFailures(const fs::path& dataset) {
  std::vector<ObjectFailure> failures;
  if (!Exists(dataset / kFailuresName)) return failures;
  const auto take = [&](const JsonValue& json) -> Status {
    ObjectFailure f;
    ANCHORSPLAT_RETURN_IF_ERROR(TakeText(json, "name", f.name));
    ANCHORSPLAT_RETURN_IF_ERROR(TakeText(json, "source", f.source));
    ANCHORSPLAT_RETURN_IF_ERROR(TakeText(json, "stage", f.stage));
    ANCHORSPLAT_RETURN_IF_ERROR(TakeText(json, "message", f.message));
    failures.push_back(std::move(f));
    return {};
  };
  ANCHORSPLAT_RETURN_IF_ERROR(ForEachLine(dataset / kFailuresName, take));
  return failures;
}

}  // namespace anchorsplat

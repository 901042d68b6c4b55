#include "dataset/object_settings.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int64_t kMostInitPoints = 100'000'000;
constexpr double kMostWhole = 9007199254740992.0;  // 2⁵³: largest exact integer in JSON

Status TakeWhole(const JsonValue& json, const char* key, int64_t& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double number, value.Number());
  if (!(number >= 0 && number <= kMostWhole) || number != static_cast<double>(static_cast<int64_t>(number))) {
    return value.Complain(Cat("expected a whole number from 0, found ", number));
  }
  out = static_cast<int64_t>(number);
  return {};
}

Status TakeInt(const JsonValue& json, const char* key, int low, int high, int& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  ANCHORSPLAT_ASSIGN_OR_RETURN(out, value.WholeNumber(low, high));
  return {};
}

Status TakeSetting(const JsonValue& json, const char* key, double& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  ANCHORSPLAT_ASSIGN_OR_RETURN(out, value.Number());
  return {};
}

Status TakeFlag(const JsonValue& json, const char* key, bool& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  if (!value.raw().is_boolean()) return value.Complain("expected true or false");
  out = value.raw().get<bool>();
  return {};
}

// Index of the name in `names`.
template <size_t count>
Status TakeNamed(const JsonValue& json, const char* key, const char* const (&names)[count], size_t& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, value.Text());
  for (out = 0; out < count; ++out) {
    if (name == names[out]) return {};
  }
  return value.Complain(Cat("unknown ", key, " \"", Printable(name), "\""));
}

Status TakeWord(const JsonValue& json, const char* key, std::string& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  ANCHORSPLAT_ASSIGN_OR_RETURN(out, value.Text());
  return {};
}

// Seeds are strings, as JSON numbers cannot hold 64 bits.
Status TakeSeed(const JsonValue& json, const char* key, uint64_t& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.Get(key));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, value.Text());
  if (text.empty() || text.size() > 20 || text.find_first_not_of("0123456789") != std::string::npos) {
    return value.Complain("expected a number of up to 20 digits as a string");
  }
  out = 0;
  for (const char digit : text) out = out * 10 + static_cast<uint64_t>(digit - '0');
  return {};
}

template <size_t count>
bool IsOneOf(const std::string& word, const char* const (&names)[count]) {
  return std::find(std::begin(names), std::end(names), word) != std::end(names);
}

Status TakeRig(const JsonValue& json, CameraRig& rig) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue kind, json.Get("rig"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, kind.Text());
  for (int k = 0; k <= std::ssize(kRigNames); ++k) {
    if (k == std::ssize(kRigNames)) return kind.Complain(Cat("unknown rig \"", Printable(name), "\""));
    if (name == kRigNames[k]) {
      rig.kind = static_cast<RigKind>(k);
      break;
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(TakeInt(json, "views", 1, 100000, rig.views));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSetting(json, "radius", rig.radius));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSetting(json, "fov_degrees", rig.fov_degrees));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue elevations, json.Get("elevations"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto elements, elevations.Elements());
  rig.elevations.clear();
  for (const JsonValue& element : elements) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double degrees, element.Number());
    rig.elevations.push_back(degrees);
  }
  return {};
}

nlohmann::json ToJson(const PictureDefects& d) {
  return {{"noise", d.noise}, {"jpeg", d.jpeg}, {"exposure", d.exposure},
          {"pose", d.pose},   {"mask", d.mask}, {"defocus", d.defocus}};
}

Status TakeDefects(const JsonValue& json, PictureDefects& d) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue defects, json.Get("defects"));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSetting(defects, "noise", d.noise));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeInt(defects, "jpeg", 0, 100, d.jpeg));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSetting(defects, "exposure", d.exposure));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSetting(defects, "pose", d.pose));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSetting(defects, "mask", d.mask));
  return TakeSetting(defects, "defocus", d.defocus);
}

// Settings of other kinds of splats; missing in records of earlier versions.
Status TakeKind(const JsonValue& json, ObjectSettings& s) {
  size_t name = 0;
  if (json.has("init")) {
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNamed(json, "init", kFitStartNames, name));
    s.start = static_cast<FitStart>(name);
  }
  if (json.has("init_points")) ANCHORSPLAT_RETURN_IF_ERROR(TakeWhole(json, "init_points", s.init_points));
  if (json.has("init_extent")) ANCHORSPLAT_RETURN_IF_ERROR(TakeSetting(json, "init_extent", s.init_extent));
  if (json.has("sh_degree")) ANCHORSPLAT_RETURN_IF_ERROR(TakeInt(json, "sh_degree", 0, kMaxShDegree, s.sh_degree));
  if (json.has("mode")) {
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNamed(json, "mode", kFitModeNames, name));
    s.mode = static_cast<RenderMode>(name);
  }
  if (json.has("pixel")) {
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNamed(json, "pixel", kFitPixelNames, name));
    s.pixel_area = name == 1;
  }
  if (json.has("strategy")) {
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNamed(json, "strategy", kStrategyNames, name));
    s.strategy = static_cast<FitPreset>(name);
  }
  if (json.has("mip_filter")) ANCHORSPLAT_RETURN_IF_ERROR(TakeFlag(json, "mip_filter", s.mip_filter));
  if (json.has("defects")) ANCHORSPLAT_RETURN_IF_ERROR(TakeDefects(json, s.defects));
  if (json.has("backdrop")) ANCHORSPLAT_RETURN_IF_ERROR(TakeFlag(json, "backdrop", s.backdrop));
  if (json.has("from")) ANCHORSPLAT_RETURN_IF_ERROR(TakeWord(json, "from", s.from));
  if (json.has("after")) ANCHORSPLAT_RETURN_IF_ERROR(TakeWord(json, "after", s.after));
  return {};
}

}  // namespace

nlohmann::json ToJson(const ObjectSettings& s) {
  const ViewSetOptions& v = s.views;
  return {{"rig", kRigNames[static_cast<size_t>(v.rig.kind)]},
          {"views", v.rig.views},
          {"radius", v.rig.radius},
          {"fov_degrees", v.rig.fov_degrees},
          {"elevations", v.rig.elevations},
          {"high_size", v.high_size},
          {"low_size", v.low_size},
          {"samples", v.trace.samples},
          {"background", v.background},
          {"opaque", v.opaque},
          {"points", v.points},
          {"store_high", v.store_high},
          {"fit_steps", s.fit_steps},
          {"downscale", s.downscale},
          {"hold_out", s.hold_out},
          {"max_gaussians", s.max_gaussians},
          {"min_train_psnr", s.min_train_psnr},
          {"seed", std::to_string(s.seed)},
          {"init", kFitStartNames[static_cast<size_t>(s.start)]},
          {"init_points", s.init_points},
          {"init_extent", s.init_extent},
          {"sh_degree", s.sh_degree},
          {"mode", kFitModeNames[static_cast<size_t>(s.mode)]},
          {"pixel", kFitPixelNames[s.pixel_area ? 1 : 0]},
          {"strategy", kStrategyNames[static_cast<size_t>(s.strategy)]},
          {"mip_filter", s.mip_filter},
          {"defects", ToJson(s.defects)},
          {"backdrop", s.backdrop},
          {"from", s.from},
          {"after", s.after}};
}

Result<ObjectSettings> ObjectSettingsFrom(const JsonValue& json) {
  ObjectSettings s;
  ViewSetOptions& v = s.views;
  ANCHORSPLAT_RETURN_IF_ERROR(TakeRig(json, v.rig));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeInt(json, "high_size", 1, 16384, v.high_size));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeInt(json, "low_size", 1, 16384, v.low_size));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeInt(json, "samples", 1, kMaxTraceSamples, v.trace.samples));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue background, json.Get("background"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto rgb, background.Numbers(3));
  for (size_t k = 0; k < 3; ++k) v.background[k] = static_cast<float>(rgb[k]);
  ANCHORSPLAT_RETURN_IF_ERROR(TakeFlag(json, "opaque", v.opaque));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeWhole(json, "points", v.points));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeFlag(json, "store_high", v.store_high));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeWhole(json, "fit_steps", s.fit_steps));
  if (json.has("downscale")) ANCHORSPLAT_RETURN_IF_ERROR(TakeInt(json, "downscale", 2, 64, s.downscale));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeInt(json, "hold_out", 0, 100000, s.hold_out));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeWhole(json, "max_gaussians", s.max_gaussians));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSetting(json, "min_train_psnr", s.min_train_psnr));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSeed(json, "seed", s.seed));
  v.seed = v.rig.seed = s.seed;
  ANCHORSPLAT_RETURN_IF_ERROR(TakeKind(json, s));
  if (const Status status = Validate(s); !status.ok()) return json.Complain(status.error().message);
  return s;
}

Status Validate(const ObjectSettings& s) {
  const auto bad = [](std::string sentence) { return Error{ErrorCode::kBadArgument, std::move(sentence)}; };
  if (const auto cameras = MakeViewSetCameras(s.views); !cameras.ok()) return cameras.error();
  if (s.views.low_size >= s.views.high_size) {
    return bad(Cat("low views of ", s.views.low_size, " pixels must be smaller than high ones of ", s.views.high_size));
  }
  if (s.views.points < 1) return bad("points must be at least 1: a fit starts from surface samples");
  if (s.fit_steps < 1 || s.fit_steps > 10'000'000) return bad(Cat("steps must be 1 to 10,000,000, not ", s.fit_steps));
  if (s.downscale < 2 || s.downscale > 64) return bad(Cat("downscale must be 2 to 64, not ", s.downscale));
  if (s.hold_out == 1) return bad("hold_out 1 holds out every view and leaves none to train on");
  for (const float x : s.views.background) {
    if (!(x >= 0 && x <= 1)) return bad(Cat("background ", x, " is not in 0 to 1"));
  }
  if (s.init_points > 0 && s.start == FitStart::kSurface) {
    return bad("init_points works only with init random and view; points sets the number of surface samples");
  }
  if (s.init_points > kMostInitPoints) return bad(Cat("init_points must be at most ", kMostInitPoints));
  if (!(s.init_extent >= 1e-3 && s.init_extent <= 1e3)) {
    return bad(Cat("init_extent ", s.init_extent, " is not in 0.001 to 1000"));
  }
  if (s.init_extent != kRandomExtent && s.start != FitStart::kRandom)
    return bad("init_extent works only with init random");
  if (s.sh_degree < 0 || s.sh_degree > kMaxShDegree) return bad(Cat("sh_degree ", s.sh_degree, " is not in 0 to 3"));
  if (s.strategy == FitPreset::kMcmc && s.max_gaussians == 0) {
    return bad("strategy mcmc needs max_gaussians, the number it grows to");
  }
  if (s.mip_filter && (s.pixel_area || s.mode != RenderMode::kClassic)) {
    return bad("mip_filter excludes mode and pixel: it sets both");
  }
  if (s.from.empty() != s.after.empty()) return bad("from and after need each other");
  if (s.IsDerived() && !IsOneOf(s.after, kAfterNames)) {
    return bad(Cat("after must be spz, sog, splat or enhanced, not \"", Printable(s.after), "\""));
  }
  return Validate(s.defects);
}

}  // namespace anchorsplat

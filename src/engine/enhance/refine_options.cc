#include "enhance/refine_options.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "cameras/photograph.h"
#include "core/number_text.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

// Stores `number` in `to` if it is representable as T.
template <class T>
bool Assign(double number, T& to) {
  if constexpr (std::is_same_v<T, bool>) {
    if (number != 0 && number != 1) return false;
  } else if constexpr (std::is_integral_v<T>) {
    constexpr double most = std::min(1e15, static_cast<double>(std::numeric_limits<T>::max()));
    if (number != std::floor(number) || !(std::abs(number) <= most)) return false;
  }
  to = static_cast<T>(number);
  return true;
}
template <class T>
bool Assign(double number, std::optional<T>& to) {
  return Assign(number, to.emplace());
}

struct NamedOption {
  std::string_view key;
  bool (*set)(RefineOptions&, double);
};

// Keys as on the command line, which declares their help.
constexpr NamedOption kOptions[] = {
    {"steps", [](RefineOptions& o, double x) { return Assign(x, o.steps); }},
    {"seconds", [](RefineOptions& o, double x) { return Assign(x, o.seconds); }},
    {"k", [](RefineOptions& o, double x) { return Assign(x, o.copies); }},
    {"max-gaussians", [](RefineOptions& o, double x) { return Assign(x, o.max_gaussians); }},
    {"most-gaussians", [](RefineOptions& o, double x) { return Assign(x, o.max_gaussians); }},  // former name
    {"hold-out", [](RefineOptions& o, double x) { return Assign(x, o.hold_out); }},
    {"downscale", [](RefineOptions& o, double x) { return Assign(x, o.downscale); }},
    {"poses", [](RefineOptions& o, double x) { return Assign(x, o.poses); }},
    {"between", [](RefineOptions& o, double x) { return Assign(x, o.between); }},
    {"half-from", [](RefineOptions& o, double x) { return Assign(x, o.half_from); }},
    {"all-from", [](RefineOptions& o, double x) { return Assign(x, o.all_from); }},
    {"rate", [](RefineOptions& o, double x) { return Assign(x, o.rate); }},
    {"rate-decay", [](RefineOptions& o, double x) { return Assign(x, o.rate_decay); }},
    {"ssim-weight", [](RefineOptions& o, double x) { return Assign(x, o.ssim_weight); }},
    {"exposure", [](RefineOptions& o, double x) { return Assign(x, o.exposure); }},
    {"robust", [](RefineOptions& o, double x) { return Assign(x, o.robust); }},
    {"align", [](RefineOptions& o, double x) { return Assign(x, o.align); }},
};

}  // namespace

Status SetRefineOption(RefineOptions& options, std::string_view key, std::string_view value) {
  for (const NamedOption& option : kOptions) {
    if (option.key != key) continue;
    double number = 0;
    const char* end = value.data() + value.size();
    const auto [stop, code] = FromChars(value.data(), end, number);
    if (code == std::errc() && stop == end && option.set(options, number)) return {};
    return Error{ErrorCode::kBadArgument, Cat("refine: ", key, " cannot be '", Printable(std::string(value)), "'")};
  }
  return Error{ErrorCode::kBadArgument,
               Cat("refine: there is no option '", Printable(std::string(key)), "' (known: ", RefineOptionKeys(), ")")};
}

std::string RefineOptionKeys() {
  std::string keys;
  for (const NamedOption& option : kOptions) keys += Cat(keys.empty() ? "" : ", ", option.key);
  return keys;
}

Status Validate(const RefineOptions& o) {
  const auto bad = [](const std::string& sentence) { return Error{ErrorCode::kBadArgument, "refine: " + sentence}; };
  if (o.steps && o.seconds) return bad("give steps or seconds, not both");
  if (o.steps && *o.steps < 1) return bad("there must be at least one step");
  if (o.seconds && !(*o.seconds > 0 && std::isfinite(*o.seconds))) return bad("seconds must be positive");
  if (o.copies && (*o.copies < 1 || *o.copies > kMostCopies)) return bad(Cat("K must be 1 to ", kMostCopies));
  if (o.max_gaussians < 0) return bad("the bound of Gaussians must not be negative");
  if (o.downscale < 1 || o.downscale > kMaxDownscale) return bad(Cat("downscale must be 1 to ", kMaxDownscale));
  if (o.hold_out && *o.hold_out < 0) return bad("hold-out must not be negative");
  if (o.poses < 1) return bad("there must be at least one pose");
  if (o.between < 0) return bad("poses between cameras must not be negative");
  if (o.rate && !(*o.rate > 0 && std::isfinite(*o.rate))) return bad("the learning rate must be positive");
  if (!(o.rate_decay > 0 && o.rate_decay <= 1)) return bad("the learning rate's decay must lie in (0, 1]");
  if (!(o.ssim_weight >= 0 && o.ssim_weight <= 1)) return bad("the SSIM weight must lie in [0, 1]");
  if (!(o.half_from >= 0 && o.half_from <= o.all_from && o.all_from <= 1)) {
    return bad("the parts with more rays per pixel must ascend from 0 to 1");
  }
  return {};
}

std::string ToJsonText(const RefineOptions& o) {
  // Flat, so that a difference has a single name.
  nlohmann::json json = {
      {"images", !o.images.empty()},
      {"hold_out", o.hold_out.value_or(-1)},
      {"steps", o.steps.value_or(0)},
      {"copies", o.copies.value_or(0)},
      {"max_gaussians", o.max_gaussians},
      {"poses", o.poses},
      {"between", o.between},
      {"half_from", o.half_from},
      {"all_from", o.all_from},
      {"rate", o.rate.value_or(0)},
      {"rate_decay", o.rate_decay},
      {"ssim_weight", o.ssim_weight},
      {"exposure", o.exposure},
      {"robust", o.robust},
      {"align", o.align},
  };
  if (o.downscale > 1) json["downscale"] = o.downscale;
  if (o.enlarged) json["enlarged"] = true;
  if (!o.images.empty()) json["split"] = "by residual";
  return json.dump();
}

}  // namespace anchorsplat

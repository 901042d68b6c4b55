#include "enhance/refine_options.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/text.h"

namespace anchorsplat {

Status Validate(const RefineOptions& o) {
  const auto bad = [](const std::string& sentence) { return Error{ErrorCode::kBadArgument, "refine: " + sentence}; };
  if (o.steps && o.seconds) return bad("give steps or seconds, not both");
  if (o.steps && *o.steps < 1) return bad("there must be at least one step");
  if (o.seconds && !(*o.seconds > 0 && std::isfinite(*o.seconds))) return bad("seconds must be positive");
  if (o.copies && (*o.copies < 1 || *o.copies > kMostCopies)) return bad(Cat("K must be 1 to ", kMostCopies));
  if (o.max_gaussians < 0) return bad("the bound of Gaussians must not be negative");
  if (o.hold_out < 0) return bad("hold-out must not be negative");
  if (o.poses < 1) return bad("there must be at least one pose");
  if (o.between < 0) return bad("poses between cameras must not be negative");
  if (!(o.rate > 0 && std::isfinite(o.rate))) return bad("the learning rate must be positive");
  if (!(o.rate_decay > 0 && o.rate_decay <= 1)) return bad("the learning rate's decay must lie in (0, 1]");
  if (!(o.ssim_weight >= 0 && o.ssim_weight <= 1)) return bad("the SSIM weight must lie in [0, 1]");
  if (!(o.half_from >= 0 && o.half_from <= o.all_from && o.all_from <= 1)) {
    return bad("the parts with more rays per pixel must ascend from 0 to 1");
  }
  return {};
}

std::string ToJsonText(const RefineOptions& o) {
  // One level, so that what differs can be named by one word.
  const nlohmann::json json = {
      {"images", !o.images.empty()},
      {"hold_out", o.hold_out},
      {"steps", o.steps.value_or(0)},
      {"copies", o.copies.value_or(0)},
      {"max_gaussians", o.max_gaussians},
      {"poses", o.poses},
      {"between", o.between},
      {"half_from", o.half_from},
      {"all_from", o.all_from},
      {"rate", o.rate},
      {"rate_decay", o.rate_decay},
      {"ssim_weight", o.ssim_weight},
      {"exposure", o.exposure},
      {"robust", o.robust},
  };
  return json.dump();
}

}  // namespace anchorsplat

#include "request/findings.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "core/splat_comments.h"
#include "core/text.h"
#include "formats/registry.h"

namespace anchorsplat {

nlohmann::json ToJson(const Reading& reading) {
  nlohmann::json made;
  for (size_t k = 0; k < kProvenanceCount; ++k) made[NameOf(static_cast<Provenance>(k))] = reading.provenance[k];
  return {{"looks", NameOf(reading.likeliest())},
          {"probabilities", made},
          {"pixel", reading.pixel},
          {"low", reading.low},
          {"high", reading.high},
          {"strangeness", reading.strangeness}};
}

nlohmann::json ToJson(const SplatFindings& f) {
  const CloudStatistics& s = f.statistics;
  const auto percentiles = [](const Percentiles& values) {
    nlohmann::json out;
    for (size_t k = 0; k < values.size(); ++k) out[Cat("p", std::lround(100 * kPercentiles[k]))] = values[k];
    return out;
  };
  nlohmann::json json = {{"file", f.file.empty() ? nlohmann::json() : nlohmann::json(f.file)},
                         {"format", f.file.empty() ? nlohmann::json() : nlohmann::json(f.format)},
                         {"facts", nlohmann::json::object()},
                         {"bytes", f.file.empty() ? nlohmann::json() : nlohmann::json(f.file_bytes)},
                         {"gaussians", s.gaussians},
                         {"sh_degree", s.sh_degree},
                         {"bounds", nullptr},
                         {"render_mode", nullptr},
                         {"reading", nullptr},
                         {"treatment", {{"method", "none"}, {"upscale", kInfoUpscale}}},
                         {"comments", f.comments},
                         {"credits", CreditsOf(f.comments)},
                         {"largest_axis", percentiles(s.largest_axis)},
                         {"smallest_axis", percentiles(s.smallest_axis)},
                         {"axis_ratio", percentiles(s.axis_ratio)},
                         {"opacity", percentiles(s.opacity)},
                         {"counts",
                          {{"not_finite", s.not_finite},
                           {"zero_quaternions", s.zero_quaternions},
                           {"unnormalised_quaternions", s.unnormalised_quaternions},
                           {"zero_scales", s.zero_scales},
                           {"invisible", s.invisible},
                           {"implausible", s.implausible},
                           {"outliers", s.outliers}}},
                         {"linear_looking_scales", s.linear_looking_scales},
                         {"linear_looking_opacities", s.linear_looking_opacities},
                         {"color_looking_harmonics", s.color_looking_harmonics},
                         {"up", nullptr},
                         {"problems", f.problems},
                         {"predicted_bytes", nlohmann::json::object()},
                         {"predicted_roughly", nlohmann::json::array()}};
  for (const auto& [name, value] : f.facts.all()) json["facts"][name] = value;
  json["origin"] = f.origin;
  if (s.bounds && IsZero(f.origin)) {
    json["bounds"] = {{"min", s.bounds->min}, {"max", s.bounds->max}};
  } else if (s.bounds) {
    json["bounds"] = {{"min", ToWorld(s.bounds->min.data(), f.origin)},
                      {"max", ToWorld(s.bounds->max.data(), f.origin)}};
  }
  if (const auto up = UpOf(f.comments)) json["up"] = *up;
  if (f.render_mode) json["render_mode"] = NameOf(*f.render_mode);
  if (f.reading.ok()) json["reading"] = ToJson(*f.reading);
  if (f.treatment.method != TreatmentMethod::kNone) {
    json["treatment"] = {{"method", f.treatment.method == TreatmentMethod::kNetwork ? "network" : "filter"},
                         {"mode", NameOf(f.treatment.mode)},
                         {"pixel", f.treatment.pixel},
                         {"gain", f.treatment.gain},
                         {"upscale", kInfoUpscale}};
  }
  for (const SplatFormat& format : Formats()) {
    if (format.write == nullptr || format.predicted_size == nullptr) continue;
    json["predicted_bytes"][std::string(format.name)] = format.predicted_size(s.gaussians, s.sh_degree);
    if (format.size_is_estimate) json["predicted_roughly"].push_back(format.name);
  }
  return json;
}

nlohmann::json ToJson(const NetworkFindings& findings) {
  return {{"file", findings.file},
          {"kind", "model"},
          {"tensors", findings.tensors},
          {"parameters", findings.parameters},
          {"metadata", findings.facts}};
}

}  // namespace anchorsplat

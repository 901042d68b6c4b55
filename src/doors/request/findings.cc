#include "request/findings.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "core/file_system.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "formats/gsplat_checkpoint/gsplat_checkpoint.h"
#include "formats/registry.h"
#include "io/input_file.h"
#include "model/compact/compact_network.h"
#include "model/published/published_checkpoint_writer.h"
#include "reading/showing_gaussians.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

constexpr int64_t kMostReadWhole = 2'000'000;  // half a gigabyte; of more, harmonics count as unknown

std::string Rows(int64_t count, int64_t of) {
  return Cat(WithThousands(count), " of ", WithThousands(of), of == 1 ? " Gaussian" : " Gaussians");
}

std::vector<std::string> Problems(const CloudStatistics& s) {
  std::vector<std::string> out;
  const auto add = [&](int64_t count, std::string_view what) {
    if (count > 0) out.push_back(Cat(Rows(count, s.gaussians), " ", what));
  };
  add(s.not_finite, Cat("with ", kWhyUnusable, "; no verb draws them, and enhance drops them"));
  add(s.zero_quaternions, "with a zero quaternion; rendered without rotation");
  add(s.zero_scales, "with a scale of zero (log-scale -Inf) on some axis; legal, flat or a point");
  add(s.outliers, "more than ten times farther out than what an orbit shows; sky, floaters or strays");
  add(s.unnormalised_quaternions, "with quaternions that are not normalised; legal, as trainers leave them so");
  add(s.implausible, "farther out or longer than a million units: is the file damaged, or of another kind?");
  add(s.invisible, "with an opacity below 1/255; never drawn");
  const auto suspect = [&out](bool is_so, const char* what, const char* option) {
    if (is_so) out.push_back(Cat(what, ": was the file converted wrongly? convert ", option, " reads it so"));
  };
  suspect(s.linear_looking_scales, "scales look like lengths, not logarithms", "--scales lengths");
  suspect(s.linear_looking_opacities, "opacities look like 0 to 1, not logits", "--opacities 0-1");
  suspect(s.color_looking_harmonics == 1, "f_dc look like colours from 0 to 1, not harmonics", "--colors 0-1");
  suspect(s.color_looking_harmonics == 255, "f_dc look like colours from 0 to 255, not harmonics", "--colors 0-255");
  return out;
}

// Goes through the Gaussians twice. `whole`: all of them with their harmonics, or none where that is too much to keep.
// Errors: of reading.
Status LookAt(CloudBlocks& blocks, const std::function<CloudView()>& whole, SplatFindings& findings) {
  findings.render_mode = blocks.render_mode();
  findings.comments = blocks.comments();
  findings.origin = blocks.origin();
  CloudView said;  // all but the Gaussians
  said.render_mode = findings.render_mode;
  said.comments = findings.comments;
  findings.lost_no_width = HasLostNoWidth(said);

  StatisticsStudy statistics(blocks);
  ShowingStudy study(blocks);
  RowStudy* const studies[] = {&statistics, &study};
  ANCHORSPLAT_RETURN_IF_ERROR(Study(blocks, studies));
  findings.statistics = statistics.Find();
  ShowingGaussians showing = study.Take();
  // Without them, what shows is read as if it had no harmonics.
  CloudView all = whole();
  if (all.size() != blocks.size()) {
    all = showing.all;
    for (size_t i = 0; i < showing.rows_of_all.size(); ++i) showing.rows_of_all[i] = static_cast<int64_t>(i);
  }
  all.render_mode = findings.render_mode;
  findings.reading = Read(all, showing);
  if (findings.reading.ok() && !findings.lost_no_width) {
    findings.treatment = Treat(*findings.reading, {.mode = findings.render_mode});
  }
  findings.problems = Problems(findings.statistics);
  return {};
}

struct ModelFindings {
  std::map<std::string, std::string> facts;
  std::vector<TensorSpec> learned;  // tensors of parameters
  size_t tensors = 0;               // all
};

Result<ModelFindings> LookAtCompactNetwork(const TensorFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CompactNetwork network, LoadCompactNetwork(file));
  ModelFindings found{file.metadata(), CompactTensors(network.config()), file.tensors().size()};
  std::erase_if(found.learned, [](const TensorSpec& tensor) { return tensor.name.starts_with("domain."); });
  for (const auto& [key, value] : ToMetadata(network.config())) found.facts[key] = value;
  return found;
}

Result<ModelFindings> LookAtCheckpoint(const std::string& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Checkpoint checkpoint, Checkpoint::Open(path));
  ModelFindings found{checkpoint.file().metadata(), PublishedTensors(checkpoint.config()),
                      checkpoint.file().tensors().size()};
  std::erase_if(found.learned, [](const TensorSpec& tensor) {
    return tensor.counter || tensor.name.ends_with("running_mean") || tensor.name.ends_with("running_var");
  });
  for (const auto& [key, value] : ArchitectureMetadata(checkpoint.config())) found.facts[key] = value;
  return found;
}

}  // namespace

std::string LooksInWords(const SplatFindings& f) {
  return f.reading.ok() ? LooksInWords(*f.reading) : "nothing: too little of it shows";
}

std::string TreatmentInWords(const SplatFindings& f) {
  if (f.lost_no_width) return "nothing: its comments say that it has lost no width";
  if (!f.reading.ok()) return "nothing without --pixel-size or --cameras: too little of it shows";
  if (f.treatment.method == TreatmentMethod::kNone) {
    return HasItsWidth(f.reading->likeliest()) ? "nothing: it has its width"
                                               : "nothing, as nothing is sure to make it better";
  }
  return Cat(f.treatment.method == TreatmentMethod::kNetwork ? "a network" : "the filter", " at pixels of ",
             f.treatment.pixel, "; ", Fixed(f.treatment.gain, 1), " dB are expected at ", kInfoUpscale, "x");
}

Result<SplatFindings> InspectSplat(const OpenedSplat& file, const std::string& name) {
  SplatFindings findings;
  findings.file = name;
  findings.file_bytes = file.bytes();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::unique_ptr<CloudBlocks> blocks, file.Blocks());
  findings.format = file.format()->name;
  std::optional<GaussianCloud> whole;
  const auto read = [&] {
    if (!whole) {
      whole.emplace();
      auto cloud = blocks->size() <= kMostReadWhole ? file.Read() : Result<GaussianCloud>(GaussianCloud());
      if (cloud.ok() && cloud->size() == blocks->size()) whole = *std::move(cloud);  // nobody has changed the file
    }
    return CloudView(*whole);
  };
  ANCHORSPLAT_RETURN_IF_ERROR(LookAt(*blocks, read, findings));
  if (file.format()->describe != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(findings.facts, file.format()->describe(file.input()));
  }
  if (!file.packed().empty()) findings.facts.Add("packed", file.packed());
  return findings;
}

SplatFindings InspectSplat(const CloudView& cloud) {
  SplatFindings findings;
  MemoryBlocks blocks(cloud);
  (void)LookAt(
      blocks, [&] { return cloud; }, findings);  // memory can be read
  return findings;
}

nlohmann::json ToJson(const Reading& reading) {
  nlohmann::json made;
  for (size_t k = 0; k < kMadeCount; ++k) made[NameOf(static_cast<Made>(k))] = reading.made[k];
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

bool LooksLikeNetwork(const std::filesystem::path& path) {
  if (!IsFile(path)) return false;  // a pipe can be read only once
  const auto in = InputFile::Open(path);
  const auto beginning = in.ok() ? in->Head(16) : Result<std::string>(in.error());
  if (!beginning.ok() || !LooksLikeTensorFile(std::as_bytes(std::span(*beginning)))) return false;
  const auto file = TensorFile::Open(path);
  if (file.ok()) return !HoldsGaussians(*file);
  const std::filesystem::path extension = path.extension();
  return extension == ".pth" || extension == ".safetensors";  // a broken one
}

Result<NetworkFindings> InspectNetwork(const std::string& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ModelFindings found,
                               IsCompactNetwork(file) ? LookAtCompactNetwork(file) : LookAtCheckpoint(path));
  NetworkFindings findings{path, std::move(found.facts), found.tensors, 0};
  for (const TensorSpec& tensor : found.learned) {
    int64_t size = 1;
    for (const int64_t side : tensor.shape) size *= side;
    findings.parameters += size;
  }
  return findings;
}

nlohmann::json ToJson(const NetworkFindings& findings) {
  return {{"file", findings.file},
          {"kind", "model"},
          {"tensors", findings.tensors},
          {"parameters", findings.parameters},
          {"metadata", findings.facts}};
}

}  // namespace anchorsplat

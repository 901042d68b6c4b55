#include "reading/splat_findings.h"

#include <functional>
#include <memory>
#include <string_view>
#include <utility>

#include "core/cloud_blocks.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "formats/registry.h"
#include "reading/visible_gaussians.h"

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
  add(s.not_finite, Cat("with ", kWhyUnusable, "; never drawn, and dropped by enhance"));
  add(s.zero_quaternions, "with a zero quaternion; drawn unrotated");
  add(s.zero_scales, "with a zero scale (log-scale -Inf); valid, flat or a point");
  add(s.outliers, "more than ten times farther out than an orbit shows; sky or floaters");
  add(s.unnormalised_quaternions, "with quaternions that are not normalised; valid, common in training output");
  add(s.implausible, "farther out or longer than a million units; the file may be damaged or misread");
  add(s.invisible, "with an opacity below 1/255; never drawn");
  const auto suspect = [&out](bool is_so, const char* what, const char* option) {
    if (is_so) out.push_back(Cat(what, "; read it with convert ", option));
  };
  suspect(s.linear_looking_scales, "scales look like lengths, not logarithms", "--scales lengths");
  suspect(s.linear_looking_opacities, "opacities look like 0 to 1, not logits", "--opacities 0-1");
  suspect(s.color_looking_harmonics == 1, "f_dc look like colours from 0 to 1, not harmonics", "--colors 0-1");
  suspect(s.color_looking_harmonics == 255, "f_dc look like colours from 0 to 255, not harmonics", "--colors 0-255");
  return out;
}

// Inspects a splat in two passes. `whole`: all Gaussians with SH, or an empty view if that is too much to keep.
// Errors: those of reading.
Status Inspect(CloudBlocks& blocks, const std::function<CloudView()>& whole, SplatFindings& findings) {
  findings.render_mode = blocks.render_mode();
  findings.comments = blocks.comments();
  findings.origin = blocks.origin();
  CloudView said;  // all but the Gaussians
  said.render_mode = findings.render_mode;
  said.comments = findings.comments;
  findings.lost_no_width = IsMarkedFullWidth(said);

  StatisticsStudy statistics(blocks);
  VisibleGaussiansStudy study(blocks);
  RowStudy* const studies[] = {&statistics, &study};
  ANCHORSPLAT_RETURN_IF_ERROR(Study(blocks, studies));
  findings.statistics = statistics.Find();
  VisibleGaussians visible = study.Take();
  // Otherwise the visible Gaussians are read as if they had no SH.
  CloudView all = whole();
  if (all.size() != blocks.size()) {
    all = visible.cloud;
    for (size_t i = 0; i < visible.rows.size(); ++i) visible.rows[i] = static_cast<int64_t>(i);
  }
  all.render_mode = findings.render_mode;
  findings.reading = Read(all, visible);
  if (findings.reading.ok() && !findings.lost_no_width) {
    findings.treatment = Treat(*findings.reading, {.mode = findings.render_mode});
  }
  findings.problems = Problems(findings.statistics);
  return {};
}

}  // namespace

std::string DescribeProvenance(const SplatFindings& f) {
  return f.reading.ok() ? DescribeProvenance(*f.reading) : "unknown: too few visible Gaussians";
}

std::string TreatmentInWords(const SplatFindings& f) {
  if (f.lost_no_width) return "no: its comments say it is already sharp";
  if (!f.reading.ok()) return "only with --pixel-size or --cameras: too few visible Gaussians";
  if (f.treatment.method == TreatmentMethod::kNone) {
    return HasFullWidth(f.reading->likeliest()) ? "no: it looks already sharp" : "no: no method is sure to help";
  }
  return Cat("yes: ", f.treatment.method == TreatmentMethod::kNetwork ? "network" : "filter", ", pixel size ",
             f.treatment.pixel, ", about +", Fixed(f.treatment.gain, 1), " dB at ", kInfoUpscale, "x");
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
  ANCHORSPLAT_RETURN_IF_ERROR(Inspect(*blocks, read, findings));
  if (file.format()->describe != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(findings.facts, file.format()->describe(file.input()));
  }
  if (!file.packed().empty()) findings.facts.Add("packed", file.packed());
  return findings;
}

SplatFindings InspectSplat(const CloudView& cloud) {
  SplatFindings findings;
  MemoryBlocks blocks(cloud);
  (void)Inspect(
      blocks, [&] { return cloud; }, findings);  // memory can be read
  return findings;
}

}  // namespace anchorsplat

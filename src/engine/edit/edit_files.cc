#include "edit/edit_files.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <new>
#include <utility>

#include "core/log.h"
#include "core/memory_limit.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "core/text.h"
#include "edit/edit_steps.h"
#include "edit/edit_stream.h"
#include "edit/merge.h"
#include "edit/moved_rows.h"
#include "formats/registry.h"
#include "formats/spz/spz_extensions.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

// Applies a splat's edits in memory and makes it relative to the result's origin.
void Finish(const EditedSplat& edited, const WorldOrigin& origin, ConvertedSplat& splat) {
  if (!edited.keep.empty()) KeepRows(splat.cloud, &splat.extras, edited.keep);
  SetShDegree(splat.cloud, edited.sh_degree);
  const RowMover mover(edited.world, edited.origin, origin, edited.sh_degree);
  constexpr int64_t kRowsPerTask = 1 << 12;
  ParallelFor(0, splat.cloud.size(), kRowsPerTask, [&](int64_t first, int64_t last) {
    mover.Move(splat.cloud, first, last);
    mover.Move(splat.extras, first, last);
  });
  splat.cloud.origin = origin;
}

// Appends the other splats to the first.
Status Merge(std::vector<ConvertedSplat>& splats, ConvertedSplat& all) {
  std::vector<std::optional<RenderMode>> modes;
  std::vector<const ExtraProperties*> extras;
  bool has_normals = false;
  for (const ConvertedSplat& splat : splats) {
    modes.push_back(splat.cloud.render_mode);
    extras.push_back(&splat.extras);
    has_normals |= !splat.extras.normals.empty();
  }
  ExtraProperties merged = MergedProperties(extras);
  int64_t gaussians = 0;
  for (size_t k = 0; k < splats.size(); ++k) {
    const int64_t count = splats[k].cloud.size();
    AppendExtras(splats[k].extras, 0, count, gaussians, has_normals, merged);
    gaussians += count;
    if (k > 0) {
      ANCHORSPLAT_RETURN_IF_ERROR(Append(all.cloud, splats[k].cloud));
      all.cloud.double_means |= splats[k].cloud.double_means;
      all.report.read_seconds += splats[k].report.read_seconds;
      all.report.gaussians_read += splats[k].report.gaussians_read;
      all.report.input_bytes += splats[k].report.input_bytes;
      all.report.sh_degree_read = std::max(all.report.sh_degree_read, splats[k].report.sh_degree_read);
      if (all.report.input_format != splats[k].report.input_format) all.report.input_format = "several formats";
    } else {
      all.cloud = std::move(splats[k].cloud);
      all.report = splats[k].report;
    }
    splats[k] = {};
  }
  all.extras = std::move(merged);
  all.cloud.render_mode = MergedMode(modes);
  return {};
}

Result<EditReport> EditInMemory(const EditJob& job, const std::filesystem::path& output, const SplatFormat& to,
                                const std::vector<OpenedSplat>& files, GaussianCloud* kept) {
  std::vector<ConvertedSplat> splats;
  for (size_t k = 0; k < files.size(); ++k) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(ConvertedSplat splat,
                                 ReadToConvert(files[k], job.inputs[k].path.string(), job.convert));
    splats.push_back(std::move(splat));
  }
  std::vector<std::unique_ptr<MemoryRows>> sources;
  std::vector<EditedSplat> edited;
  for (size_t k = 0; k < splats.size(); ++k) {
    const GaussianCloud& cloud = splats[k].cloud;
    sources.push_back(std::make_unique<MemoryRows>(cloud, splats[k].extras));
    edited.push_back({.name = job.inputs[k].path.string(),
                      .rows = sources.back().get(),
                      .extras = &splats[k].extras,
                      .origin = cloud.origin,
                      .sh_degree = cloud.sh_degree,
                      .comments = cloud.comments,
                      .kept = cloud.size()});
  }
  EditReport report;
  ANCHORSPLAT_ASSIGN_OR_RETURN(report.steps, ApplyJob(job, edited));
  DropPlaces(edited);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const WorldOrigin origin, ChooseEditedOrigin(edited));
  for (size_t k = 0; k < splats.size(); ++k) Finish(edited[k], origin, splats[k]);
  std::vector<std::string> comments = MergedComments(edited);
  ConvertedSplat all;
  if (splats.size() == 1) {
    all = std::move(splats[0]);
  } else {
    ANCHORSPLAT_RETURN_IF_ERROR(Merge(splats, all));
  }
  all.cloud.comments = std::move(comments);
  if (job.convert.render_mode) all.cloud.render_mode = job.convert.render_mode;
  if (job.convert.sh_degree) SetShDegree(all.cloud, std::max(all.cloud.sh_degree, *job.convert.sh_degree));
  if (job.convert.max_gaussians) {
    const int64_t before = all.cloud.size();
    KeepMostImportant(all.cloud, *job.convert.max_gaussians, &all.extras);
    report.steps.push_back(
        {Cat("--max-gaussians ", *job.convert.max_gaussians), "", before - all.cloud.size(), all.cloud.size(), true});
  }
  if (job.dry_run) {
    report.convert = all.report;
    report.convert.output_format = to.name;
    report.convert.gaussians_written = all.cloud.size();
    report.convert.sh_degree_written = std::min(all.cloud.sh_degree, to.range.sh_degree);
    PredictBytes(to, all.cloud, all.cloud.size(), all.extras, report.convert);
    return report;
  }
  if (to.keeps_all_values) WarnOfUndrawn(output, CountUnusable(all.cloud, false), all.cloud.size());
  ANCHORSPLAT_ASSIGN_OR_RETURN(report.convert, WriteConverted(std::move(all), output, job.convert, kept));
  return report;
}

}  // namespace

bool EditJob::edits() const {
  return dry_run || inputs.size() > 1 || !actions.empty() ||
         std::ranges::any_of(inputs, [](const EditInput& input) { return !input.actions.empty(); });
}

double SecondsNow() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Result<std::vector<EditStep>> ApplyJob(const EditJob& job, std::span<EditedSplat> splats) {
  std::vector<EditStep> steps;
  const auto add = [&](std::vector<EditStep> more) { std::ranges::move(more, std::back_inserter(steps)); };
  for (size_t k = 0; k < splats.size(); ++k) {
    if (job.inputs[k].actions.empty()) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        auto more, ApplyActions(splats.subspan(k, 1), job.inputs[k].actions, splats.size() > 1 ? splats[k].name : ""));
    add(std::move(more));
  }
  std::vector<EditAction> actions = job.actions;
  if (job.convert.sh_degree) {
    actions.push_back({Cat("--sh-degree ", *job.convert.sh_degree), LowerShDegree{*job.convert.sh_degree}});
  }
  if (job.convert.min_opacity > 0) {
    actions.push_back({Cat("--min-opacity ", job.convert.min_opacity), KeepOpaque{job.convert.min_opacity}});
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(auto more, ApplyActions(splats, actions, ""));
  add(std::move(more));
  if (std::ranges::any_of(splats, [](const EditedSplat& splat) { return splat.kept > 0; })) return steps;
  std::string last = "the input has no Gaussians";
  for (const EditStep& step : steps) {
    if (step.taken > 0) last = Cat(step.action, " removes the last ", WithThousands(step.taken), " Gaussians");
  }
  return Error{ErrorCode::kBadArgument, Cat(splats[0].name, ": ", last, ": nothing to write")};
}

std::vector<int64_t> PlacesOfBlocks(const EditedSplat& splat, int64_t begin) {
  std::vector<int64_t> places = {begin};
  for (int64_t first = 0; first < splat.rows->size(); first += kRowsPerBlock) {
    const int64_t last = std::min(first + kRowsPerBlock, splat.rows->size());
    const int64_t kept =
        splat.keep.empty() ? last - first : std::count(splat.keep.begin() + first, splat.keep.begin() + last, char{1});
    places.push_back(places.back() + kept);
  }
  return places;
}

void DropPlaces(std::span<EditedSplat> splats) {
  for (EditedSplat& splat : splats) {
    if (!(splat.world == Similarity{})) DropSpzGeoreference(splat.name, splat.comments);
  }
}

void WarnOfUndrawn(const std::filesystem::path& output, int64_t undrawn, int64_t gaussians) {
  if (undrawn == 0) return;
  LogWarning(Cat(output.string(), ": ", WithThousands(undrawn), " of ", WithThousands(gaussians),
                 " Gaussians cannot be drawn: ", kWhyUnusable));
}

Result<EditReport> EditFiles(const EditJob& job, const std::filesystem::path& output, GaussianCloud* kept) try {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* const to, WrittenFormat(output, job.convert));
  const InputRecord record;
  std::vector<OpenedSplat> files;
  for (const EditInput& input : job.inputs) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(OpenedSplat file, OpenedSplat::Open(input.path, job.convert.input_format));
    files.push_back(std::move(file));
  }
  if (!job.dry_run) ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(output));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<PlyInput> inputs,
                               StreamableInputs(job, output, files, kept != nullptr));
  if (!inputs.empty()) return EditStreams(job, output, files, inputs);
  return EditInMemory(job, output, *to, files, kept);
} catch (const DiskFull& none) {
  return Error{ErrorCode::kIo, Cat(output.string(), ": ", none.what())};
} catch (const std::bad_alloc&) {
  return Error{ErrorCode::kIo, Cat(output.string(), ": not enough memory for its Gaussians")};
}

}  // namespace anchorsplat

#include "edit/edit_stream.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <utility>

#include "core/log.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "core/text.h"
#include "edit/edit_steps.h"
#include "edit/merge.h"
#include "edit/moved_rows.h"
#include "formats/first_failure.h"
#include "formats/ply/ply_writer.h"
#include "formats/registry.h"

namespace anchorsplat {

namespace {

class PlyRowSource final : public RowSource {
 public:
  explicit PlyRowSource(const PlyInput& input) : input_(input) {}
  int64_t size() const override { return input_.size(); }
  Status Show(int64_t first, int64_t last, const Look& look) override {
    GaussianCloud rows;
    ExtraProperties extras;
    ANCHORSPLAT_RETURN_IF_ERROR(input_.Read(first, last, rows, extras));
    CloudView view = rows;
    view.origin = input_.head().origin;
    look({first, view, &extras, 0});
    return {};
  }
  Status ForEach(const Look& look) override {
    FirstFailure failure;
    ParallelFor(0, size(), kRowsPerBlock,
                [&](int64_t first, int64_t last) { failure.Report(first, Show(first, last, look)); });
    return failure.status();
  }

 private:
  const PlyInput& input_;
};

// Warnings that follow OpenedSplat::Read, from a sample of rows over the whole file.
Status WarnOfStoredRows(const std::string& name, const PlyInput& input) {
  constexpr int64_t kRuns = 64, kRun = 256;
  GaussianCloud sample, rows;
  ExtraProperties extras;
  for (int64_t k = 0; k < kRuns; ++k) {
    const int64_t first = input.size() <= kRuns * kRun ? k * kRun : k * (input.size() - kRun) / (kRuns - 1);
    const int64_t last = std::min(first + kRun, input.size());
    if (first >= last) break;
    ANCHORSPLAT_RETURN_IF_ERROR(input.Read(first, last, rows, extras));
    SetShDegree(rows, 0);
    if (sample.empty()) {
      sample = rows;
    } else {
      ANCHORSPLAT_RETURN_IF_ERROR(Append(sample, rows));
    }
  }
  WarnOfStored(name, sample, {});
  return {};
}

// What all blocks of the output share.
struct Writing {
  const PlyOutput& file;
  const CloudView& head;
  const ExtraProperties& properties;
  bool merges;
  std::atomic<int64_t> undrawn = 0;
};

// Edits rows [first, last) of an input and writes the kept ones from row `to` of the output.
Status WriteBlock(const PlyInput& input, const EditedSplat& splat, const RowMover& mover, int64_t first, int64_t last,
                  int64_t to, Writing& writing) {
  GaussianCloud rows;
  ExtraProperties extras;
  ANCHORSPLAT_RETURN_IF_ERROR(input.Read(first, last, rows, extras));
  if (!splat.keep.empty()) {
    KeepRows(rows, &extras, std::vector<char>(splat.keep.begin() + first, splat.keep.begin() + last));
  }
  SetShDegree(rows, splat.sh_degree);
  mover.Move(rows, 0, rows.size());
  mover.Move(extras, 0, rows.size());
  writing.undrawn += CountUnusable(rows, false);
  SetShDegree(rows, writing.head.sh_degree);
  rows.origin = writing.head.origin;
  rows.double_means = writing.head.double_means;
  if (!writing.merges) return writing.file.Write(rows, extras, 0, rows.size(), to);
  ExtraProperties merged;
  merged.properties = writing.properties.properties;
  AppendExtras(extras, 0, rows.size(), 0, !extras.normals.empty(), merged);
  return writing.file.Write(rows, merged, 0, rows.size(), to);
}

Status WriteRows(const PlyInput& input, const EditedSplat& splat, const RowMover& mover, int64_t begin,
                 Writing& writing) {
  const std::vector<int64_t> places = PlacesOfBlocks(splat, begin);
  FirstFailure failure;
  ParallelFor(0, input.size(), kRowsPerBlock, [&](int64_t first, int64_t last) {
    const auto block = static_cast<size_t>(first / kRowsPerBlock);
    if (places[block] == places[block + 1]) return;
    failure.Report(first, WriteBlock(input, splat, mover, first, last, places[block], writing));
  });
  return failure.status();
}

// The result without rows.
Result<GaussianCloud> HeadOf(const EditJob& job, const std::vector<PlyInput>& inputs, std::span<EditedSplat> splats) {
  GaussianCloud head;
  std::vector<std::optional<RenderMode>> modes;
  for (size_t k = 0; k < inputs.size(); ++k) {
    head.sh_degree = std::max(head.sh_degree, splats[k].sh_degree);
    modes.push_back(inputs[k].head().render_mode);
  }
  head.sh_degree = std::max(head.sh_degree, job.convert.sh_degree.value_or(0));
  head.render_mode = job.convert.render_mode ? job.convert.render_mode : MergedMode(modes);
  head.comments = MergedComments(splats);
  head.double_means = job.convert.double_means;
  ANCHORSPLAT_ASSIGN_OR_RETURN(head.origin, ChooseEditedOrigin(splats));
  return head;
}

ExtraProperties PropertiesOf(const std::vector<PlyInput>& inputs) {
  if (inputs.size() == 1) return inputs[0].extras();
  std::vector<const ExtraProperties*> extras;
  for (const PlyInput& input : inputs) extras.push_back(&input.extras());
  return MergedProperties(extras);
}

Status Write(const EditJob& job, const std::filesystem::path& output, const std::vector<PlyInput>& inputs,
             std::span<const EditedSplat> splats, const CloudView& head, const ExtraProperties& properties,
             ConvertReport& report) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      PlyOutput file, PlyOutput::Create(output, head, report.gaussians_written, job.convert.write, properties));
  Writing writing{file, head, properties, inputs.size() > 1};
  int64_t begin = 0;
  for (size_t k = 0; k < inputs.size(); ++k) {
    const RowMover mover(splats[k].world, splats[k].origin, head.origin, splats[k].sh_degree);
    ANCHORSPLAT_RETURN_IF_ERROR(WriteRows(inputs[k], splats[k], mover, begin, writing));
    begin += splats[k].kept;
  }
  ANCHORSPLAT_RETURN_IF_ERROR(file.Commit());
  WarnOfUndrawn(output, writing.undrawn, report.gaussians_written);
  if (const std::string lost = properties.lost(true); !lost.empty()) {
    LogWarning(Cat(output.string(), ": extra properties of the input dropped: ", lost));
  }
  if (const Result<OpenedSplat> written = OpenWritten(output, job.convert.write); written.ok()) {
    report.output_bytes = written->bytes();
  }
  return {};
}

}  // namespace

Result<std::vector<PlyInput>> StreamableInputs(const EditJob& job, const std::filesystem::path& output,
                                               const std::vector<OpenedSplat>& files, bool kept) {
  const ConvertOptions& how = job.convert;
  const SplatFormat* const to = FormatOfExtension(output);
  const bool whole = kept || how.measure || how.max_gaussians || how.input_axes || how.output_axes ||
                     how.write.order == SplatOrder::kMorton || how.write.order == SplatOrder::kImportance ||
                     how.lod_level > 0 || !(how.stored == StoredAs{});
  if (whole || to == nullptr || to->name != "PLY") return std::vector<PlyInput>();
  std::vector<PlyInput> inputs;
  for (const OpenedSplat& file : files) {
    if (file.format() == nullptr || file.format()->name != "PLY") return std::vector<PlyInput>();
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::optional<PlyInput> input, PlyInput::Open(file.input(), {}));
    if (!input) return std::vector<PlyInput>();
    inputs.push_back(*std::move(input));
  }
  return inputs;
}

Result<EditReport> EditStreams(const EditJob& job, const std::filesystem::path& output,
                               const std::vector<OpenedSplat>& files, const std::vector<PlyInput>& inputs) {
  EditReport report;
  report.streamed = true;
  report.convert.input_format = report.convert.output_format = "PLY";
  std::vector<std::unique_ptr<PlyRowSource>> sources;
  std::vector<EditedSplat> splats;
  const double begin = SecondsNow();
  for (size_t k = 0; k < inputs.size(); ++k) {
    const PlyInput& input = inputs[k];
    const std::string name = job.inputs[k].path.string();
    sources.push_back(std::make_unique<PlyRowSource>(input));
    splats.push_back({.name = name,
                      .rows = sources.back().get(),
                      .extras = &input.extras(),
                      .origin = input.head().origin,
                      .sh_degree = input.head().sh_degree,
                      .comments = input.head().comments,
                      .kept = input.size()});
    report.convert.gaussians_read += input.size();
    report.convert.sh_degree_read = std::max(report.convert.sh_degree_read, input.head().sh_degree);
    report.convert.input_bytes += files[k].bytes();
    ANCHORSPLAT_RETURN_IF_ERROR(WarnOfStoredRows(name, input));
    input.Warn();
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(report.steps, ApplyJob(job, splats));
  DropPlaces(splats);
  report.convert.read_seconds = SecondsNow() - begin;
  for (const EditedSplat& splat : splats) report.convert.gaussians_written += splat.kept;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud head, HeadOf(job, inputs, splats));
  report.convert.sh_degree_written = head.sh_degree;
  const ExtraProperties properties = PropertiesOf(inputs);
  PredictBytes(*FormatOfExtension(output), head, report.convert.gaussians_written, properties, report.convert);
  if (job.dry_run) return report;
  const double written = SecondsNow();
  ANCHORSPLAT_RETURN_IF_ERROR(Write(job, output, inputs, splats, head, properties, report.convert));
  report.convert.write_seconds = SecondsNow() - written;
  return report;
}

}  // namespace anchorsplat

#include "formats/convert.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <numeric>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/log.h"
#include "core/memory_limit.h"
#include "core/row_arrays.h"
#include "core/splat_comments.h"
#include "core/statistics.h"
#include "core/text.h"
#include "core/world_up.h"
#include "formats/extra_properties.h"
#include "formats/hidden_rows.h"
#include "formats/opened_splat.h"
#include "formats/ply/ply_writer.h"
#include "formats/registry.h"
#include "formats/splat_order.h"
#include "formats/spz/spz_extensions.h"
#include "io/input_record.h"
#include "io/output_memory.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

double Now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// All arrays of the cloud with their row widths.
template <typename Visit>
void ForEachArray(GaussianCloud& cloud, Visit&& visit) {
  visit(cloud.means, 3);
  visit(cloud.log_scales, 3);
  visit(cloud.quats, 4);
  visit(cloud.opacity_logits, 1);
  visit(cloud.sh, cloud.sh_stride());
}

void TurnBoth(const AxisTurn& axes, GaussianCloud& cloud, ExtraProperties& extras) {
  TurnAxes(cloud, axes);
  TurnAxes(extras, axes);
}

}  // namespace

void KeepRows(GaussianCloud& cloud, ExtraProperties* extras, const std::vector<char>& keep) {
  ForEachArray(cloud, [&keep](Buffer<float>& array, int64_t width) { KeepRows(array, width, keep); });
  if (extras != nullptr) KeepRows(*extras, keep);
}

Status ParseAxes(std::string_view text, ConvertOptions& options) {
  const size_t colon = std::min(text.find(':'), text.size());
  const std::string_view parts[2] = {text.substr(0, colon), colon < text.size() ? text.substr(colon + 1) : ""};
  std::optional<Axes>* const axes[2] = {&options.input_axes, &options.output_axes};
  for (size_t k = 0; k < 2; ++k) {
    if (parts[k].empty()) continue;
    *axes[k] = AxesFromName(parts[k]);
    if (!*axes[k]) {
      return Error{ErrorCode::kBadArgument, Cat("\"", Printable(std::string(parts[k])),
                                                "\" are not axes: expected Right or Left, Up or Down, Front or Back, "
                                                "each once, for x, y and z, as in RDF, RUB or "
                                                "RFU")};
    }
  }
  if (parts[0].empty() && parts[1].empty()) {
    return Error{ErrorCode::kBadArgument, "expected axes as IN:OUT, for example RUB:RDF"};
  }
  return {};
}

void DropFaint(GaussianCloud& cloud, float min_opacity, ExtraProperties* extras) {
  if (!(min_opacity > 0)) return;
  std::vector<char> keep(static_cast<size_t>(cloud.size()));
  for (size_t i = 0; i < keep.size(); ++i) {
    const bool drawn = IsUsable(cloud, static_cast<int64_t>(i));
    keep[i] = drawn && Sigmoid(cloud.opacity_logits[i]) >= min_opacity ? 1 : 0;
  }
  KeepRows(cloud, extras, keep);
}

void KeepMostImportant(GaussianCloud& cloud, int64_t most, ExtraProperties* extras) {
  if (cloud.size() <= most) return;
  const Buffer<uint32_t> order = ImportanceOrder(cloud);
  std::vector<char> keep(static_cast<size_t>(cloud.size()), 0);
  for (int64_t i = 0; i < most; ++i) keep[order[static_cast<size_t>(i)]] = 1;
  KeepRows(cloud, extras, keep);
}

void SetShDegree(GaussianCloud& cloud, int degree) {
  if (degree > cloud.sh_degree) {
    cloud = WithShDegree(cloud, degree);
    return;
  }
  const int64_t from = cloud.sh_stride();
  cloud.sh_degree = degree;
  const int64_t to = cloud.sh_stride();
  if (from == to) return;
  for (int64_t i = 1; i < cloud.size(); ++i) {
    std::memmove(cloud.sh.data() + i * to, cloud.sh.data() + i * from, static_cast<size_t>(to) * sizeof(float));
  }
  cloud.sh.resize(static_cast<size_t>(cloud.size() * to));
}

void Reorder(GaussianCloud& cloud, const Buffer<uint32_t>& rows, ExtraProperties* extras) {
  ForEachArray(cloud, [&rows](Buffer<float>& array, int64_t width) { ReorderRows(array, width, rows); });
  if (extras != nullptr) ReorderRows(*extras, rows);
}

Result<OpenedSplat> OpenWritten(const fs::path& output, const CloudWriteOptions& write) {
  const SplatFormat* const format = FormatOfExtension(output);
  if (write.memory == nullptr) return OpenedSplat::Open(output, format);
  const std::vector<std::byte>& bytes = write.memory->files.at(output);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return OpenedSplat::Of(InputFile::View(output.string(), text), format);
}

Result<GaussianCloud> ReadBack(const fs::path& output, const CloudWriteOptions& write, const CloudView& written,
                               ExtraProperties* extras) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenWritten(output, write));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud back, file.Read({}, extras));
  if (!file.format()->keeps_origin) back.origin = written.origin;  // a warning gave the origin
  return back;
}

Result<const SplatFormat*> WrittenFormat(const fs::path& output, const ConvertOptions& options) {
  const SplatFormat* const to = FormatOfExtension(output);
  if (to == nullptr || to->write == nullptr) return WriteCloud(output, GaussianCloud{}, options.write).error();
  return to;
}

Result<ConvertedSplat> ReadToConvert(const OpenedSplat& file, const std::string& name, const ConvertOptions& options) {
  ConvertedSplat splat;
  ConvertReport& report = splat.report;
  const SplatFormat* const from = file.format();
  if (options.lod_level > 0 && (from == nullptr || from->name != "streamed SOG")) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--lod-level has no effect on ", name, "; it works only with a lod-meta.json input")};
  }
  const double begin = Now();
  ANCHORSPLAT_ASSIGN_OR_RETURN(splat.cloud, file.Read({.lod_level = options.lod_level}, &splat.extras));
  report.read_seconds = Now() - begin;
  report.input_format = from != nullptr ? from->name : "";
  report.gaussians_read = splat.cloud.size();
  report.sh_degree_read = splat.cloud.sh_degree;
  report.input_bytes = file.bytes();
  WarnOfStored(name, splat.cloud, options.stored);
  ConvertToStored(splat.cloud, options.stored, splat.extras.full_color);
  splat.cloud.double_means |= options.double_means;
  // Readers and writers follow their formats and the file's declaration; the options' axes come on top.
  if (options.input_axes || options.output_axes) DropSpzGeoreference(name, splat.cloud.comments);
  if (options.input_axes) {
    Axes taken = from != nullptr ? from->axes : kRdf;
    if (from != nullptr && from->declared_axes != nullptr) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(taken, from->declared_axes(file.input()));
    }
    TurnBoth(Concatenate(TurnBetween(kRdf, taken), TurnBetween(*options.input_axes, kRdf)), splat.cloud, splat.extras);
  }
  return splat;
}

void WarnOfUnusable(const SplatFormat& to, const std::string& name, const GaussianCloud& cloud) {
  // Without SH, which would take longer than everything else here. Other formats report unusable Gaussians when
  // written.
  if (const int64_t bad = to.keeps_all_values ? CountUnusable(cloud, false) : 0; bad > 0) {
    LogWarning(Cat(name, ": ", WithThousands(bad), " of ", WithThousands(cloud.size()),
                   " Gaussians cannot be drawn: ", kWhyUnusable));
  }
}

void PredictBytes(const SplatFormat& to, const CloudView& head, int64_t gaussians, const ExtraProperties& extras,
                  ConvertReport& report) {
  report.predicted_roughly = to.size_is_estimate;
  if (to.predicted_size == nullptr) return;
  report.predicted_bytes = to.predicted_size(gaussians, head.sh_degree);
  if (to.write_with_extras != nullptr) *report.predicted_bytes += ExtraPlyBytes(head, gaussians, extras);
}

Result<ConvertReport> WriteConverted(ConvertedSplat splat, const fs::path& output, const ConvertOptions& options,
                                     GaussianCloud* kept) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* const to, WrittenFormat(output, options));
  ConvertReport report = std::move(splat.report);
  GaussianCloud& cloud = splat.cloud;
  ExtraProperties& extras = splat.extras;
  report.output_format = to->name;
  if (options.output_axes) {
    const AxisTurn written = Concatenate(TurnBetween(kRdf, *options.output_axes), TurnBetween(to->axes, kRdf));
    const bool said = UpOf(cloud.comments).has_value();
    TurnBoth(written, cloud, extras);
    // The reader's assumption no longer holds.
    if (!said && written.matrix()[4] != 1 && to->comments != CommentPlace::kNone) {
      cloud.comments.push_back(UpComment(kUsualUp));
      TurnUpComments(written.matrix(), cloud.comments);
    }
  }
  CloudWriteOptions write = options.write;
  if (write.order != SplatOrder::kFormat) {
    if (Buffer<uint32_t> rows = WriteOrder(cloud, write.order, SplatOrder::kKeep); !rows.empty()) {
      Reorder(cloud, rows, &extras);
    }
    write.order = SplatOrder::kKeep;
  }

  const double written = Now();
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCloud(output, cloud, write, extras));
  report.write_seconds = Now() - written;
  report.gaussians_written = cloud.size();
  report.sh_degree_written = std::min(cloud.sh_degree, to->range.sh_degree);
  if (const Result<OpenedSplat> written_file = OpenWritten(output, write); written_file.ok()) {
    report.output_bytes = written_file->bytes();
  }
  PredictBytes(*to, cloud, cloud.size(), extras, report);
  if (options.measure && to->read != nullptr) {
    ExtraProperties written_extras;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud back, ReadBack(output, write, cloud, &written_extras));
    if (to->written_rows != nullptr) {
      const Buffer<uint32_t> rows = to->written_rows(cloud, write);
      const Buffer<int64_t> kept_rows(rows.begin(), rows.end());
      ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud written_cloud, Subset(cloud, kept_rows));
      Buffer<double> world;
      for (const uint32_t row : extras.world.empty() ? Buffer<uint32_t>() : rows) {
        const auto at = extras.world.begin() + 3 * int64_t{row};
        world.insert(world.end(), at, at + 3);
      }
      ANCHORSPLAT_ASSIGN_OR_RETURN(report.error, CompareAttributes(back, written_cloud, {}, world));
    } else {
      HiddenRows hidden = HideRows(*to, cloud);
      const CloudView expected = hidden.any() ? CloudView(hidden.written) : CloudView(cloud);
      const Buffer<uint32_t> order = WriteOrder(expected, write.order, to->order);
      for (const Buffer<int64_t>* rows : {&hidden.unusable, &hidden.strays.rows}) {  // nothing to compare
        for (const int64_t row : *rows) hidden.written.opacity_logits[static_cast<size_t>(row)] = std::nanf("");
      }
      ANCHORSPLAT_ASSIGN_OR_RETURN(report.error,
                                   CompareAttributes(back, expected, order, extras.world, written_extras.world));
    }
  }
  if (kept != nullptr) *kept = std::move(cloud);
  return report;
}

Result<ConvertReport> ConvertFile(const fs::path& input, const fs::path& output, const ConvertOptions& options,
                                  GaussianCloud* kept) try {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* const to, WrittenFormat(output, options));
  const InputRecord record;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Open(input, options.input_format));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(output));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ConvertedSplat splat, ReadToConvert(file, input.string(), options));
  GaussianCloud& cloud = splat.cloud;
  WarnOfUnusable(*to, input.string(), cloud);
  if (options.render_mode) cloud.render_mode = options.render_mode;
  if (options.sh_degree) SetShDegree(cloud, *options.sh_degree);
  DropFaint(cloud, options.min_opacity, &splat.extras);
  if (options.max_gaussians) KeepMostImportant(cloud, *options.max_gaussians, &splat.extras);
  if (cloud.empty()) {
    return Error{ErrorCode::kBadArgument, Cat(input.string(), ": no Gaussian has an opacity of ", options.min_opacity,
                                              " or more: nothing to write")};
  }
  return WriteConverted(std::move(splat), output, options, kept);
} catch (const DiskFull& none) {
  return Error{ErrorCode::kIo, Cat(input.string(), ": ", none.what())};
} catch (const std::bad_alloc&) {
  return Error{ErrorCode::kIo, Cat(input.string(), ": not enough memory for its Gaussians")};
}

}  // namespace anchorsplat

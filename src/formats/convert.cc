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

#include "core/text.h"
#include "formats/input_file.h"
#include "formats/quantize.h"
#include "formats/registry.h"
#include "formats/sog_writer.h"
#include "formats/splat_order.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

double Now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Every array of the cloud with the width of its rows.
template <typename Visit>
void ForEachArray(GaussianCloud& cloud, Visit&& visit) {
  visit(cloud.means, 3);
  visit(cloud.log_scales, 3);
  visit(cloud.quats, 4);
  visit(cloud.opacity_logits, 1);
  visit(cloud.sh, cloud.sh_stride());
}

// Closes up the rows for which keep[i] is set; their order stays.
void KeepRows(GaussianCloud& cloud, const std::vector<char>& keep) {
  ForEachArray(cloud, [&keep](Buffer<float>& array, int64_t width) {
    float* to = array.data();
    for (size_t i = 0; i < keep.size(); ++i) {
      if (keep[i] == 0) continue;
      const float* from = array.data() + static_cast<int64_t>(i) * width;
      if (to != from) std::memmove(to, from, static_cast<size_t>(width) * sizeof(float));
      to += width;
    }
    array.resize(static_cast<size_t>(to - array.data()));
  });
}

uint64_t SizeOf(const fs::path& path) {
  std::error_code ignored;
  const auto size = fs::file_size(path, ignored);
  return ignored ? 0 : size;
}

// A SOG folder is its meta.json and the pictures beside it; other files are themselves.
uint64_t OutputSize(const fs::path& path, int sh_degree) {
  uint64_t sum = SizeOf(path);
  if (path.filename() != "meta.json") return sum;
  for (const char* picture : SogPictures(sh_degree)) sum += SizeOf(path.parent_path() / picture);
  return sum;
}

}  // namespace

Status ParseAxes(std::string_view text, ConvertOptions& options) {
  const size_t colon = std::min(text.find(':'), text.size());
  const std::string_view parts[2] = {text.substr(0, colon), colon < text.size() ? text.substr(colon + 1) : ""};
  std::optional<Axes>* const axes[2] = {&options.input_axes, &options.output_axes};
  for (size_t k = 0; k < 2; ++k) {
    if (parts[k].empty()) continue;
    *axes[k] = AxesFromName(parts[k]);
    if (!*axes[k]) {
      return Error{
          ErrorCode::kBadArgument,
          Cat("\"", Printable(std::string(parts[k])),
              "\" are no axes: expected Right or Left, Up or Down, Front or Back for x, y, z, as in RDF or RUB")};
    }
  }
  if (parts[0].empty() && parts[1].empty()) {
    return Error{ErrorCode::kBadArgument, "expected axes as IN:OUT, for example RUB:RDF"};
  }
  return {};
}

void DropFaint(GaussianCloud& cloud, float min_opacity) {
  if (!(min_opacity > 0)) return;
  std::vector<char> keep(static_cast<size_t>(cloud.size()));
  for (size_t i = 0; i < keep.size(); ++i) keep[i] = Sigmoid(cloud.opacity_logits[i]) >= min_opacity ? 1 : 0;
  KeepRows(cloud, keep);
}

void KeepMostImportant(GaussianCloud& cloud, int64_t most) {
  if (cloud.size() <= most) return;
  const Buffer<uint32_t> order = ImportanceOrder(cloud);
  std::vector<char> keep(static_cast<size_t>(cloud.size()), 0);
  for (int64_t i = 0; i < most; ++i) keep[order[static_cast<size_t>(i)]] = 1;
  KeepRows(cloud, keep);
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

void Reorder(GaussianCloud& cloud, Buffer<uint32_t> rows) {
  // Along the cycles of the permutation, so that there is no second copy of any array.
  ForEachArray(cloud, [&rows](Buffer<float>& array, int64_t width) {
    const size_t bytes = static_cast<size_t>(width) * sizeof(float);
    const auto row = [&](uint32_t i) { return array.data() + int64_t{i} * width; };
    std::vector<char> done(rows.size(), 0);
    Buffer<float> held(static_cast<size_t>(width));
    for (uint32_t start = 0; start < rows.size(); ++start) {
      if (done[start] != 0 || rows[start] == start) continue;
      std::memcpy(held.data(), row(start), bytes);
      uint32_t at = start;
      while (rows[at] != start) {
        std::memcpy(row(at), row(rows[at]), bytes);
        done[at] = 1;
        at = rows[at];
      }
      std::memcpy(row(at), held.data(), bytes);
      done[at] = 1;
    }
  });
}

Result<ConvertReport> ConvertFile(const fs::path& input, const fs::path& output, const ConvertOptions& options,
                                  GaussianCloud* kept) try {
  ConvertReport report;
  const SplatFormat* const to = FormatOfExtension(output);
  if (to == nullptr || to->write == nullptr) return WriteCloud(output, GaussianCloud{}, options.write).error();
  // Opened once: a pipe can be read only once.
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(input));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(kSniffBytes));
  const SplatFormat* const from = FormatOfFile(head, input);

  const double begin = Now();
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, ReadOpenCloud(file));
  report.read_seconds = Now() - begin;
  report.input_format = from != nullptr ? from->name : "";
  report.output_format = to->name;
  report.gaussians_read = cloud.size();
  report.sh_degree_read = cloud.sh_degree;
  report.input_bytes = file.size();

  if (options.sh_degree) SetShDegree(cloud, *options.sh_degree);
  DropFaint(cloud, options.min_opacity);
  if (options.max_gaussians) KeepMostImportant(cloud, *options.max_gaussians);
  if (cloud.empty()) {
    return Error{ErrorCode::kBadArgument, Cat(input.string(), ": no Gaussian has an opacity of ", options.min_opacity,
                                              " or more: nothing to write")};
  }
  // Readers and writers follow their formats; what the file really is comes on top.
  if (options.input_axes) FlipAxes(cloud, FlipBetween(from != nullptr ? from->axes : kRdf, *options.input_axes));
  if (options.output_axes) FlipAxes(cloud, FlipBetween(to->axes, *options.output_axes));
  WriteOptions write = options.write;
  if (write.order != SplatOrder::kFormat) {
    if (Buffer<uint32_t> rows = WriteOrder(cloud, write.order, SplatOrder::kKeep); !rows.empty()) {
      Reorder(cloud, std::move(rows));
    }
    write.order = SplatOrder::kKeep;
  }

  const double written = Now();
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCloud(output, cloud, write));
  report.write_seconds = Now() - written;
  report.gaussians_written = cloud.size();
  report.sh_degree_written = std::min(cloud.sh_degree, to->range.sh_degree);
  report.output_bytes = OutputSize(output, cloud.sh_degree);
  if (to->predicted_size != nullptr) report.predicted_bytes = to->predicted_size(cloud.size(), cloud.sh_degree);
  report.predicted_roughly = to->size_is_estimate;
  if (options.measure && to->read != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud back, ReadCloud(output));
    ANCHORSPLAT_ASSIGN_OR_RETURN(report.error,
                                 CompareAttributes(back, cloud, WriteOrder(cloud, write.order, to->order)));
  }
  if (kept != nullptr) *kept = std::move(cloud);
  return report;
} catch (const std::bad_alloc&) {
  return Error{ErrorCode::kIo, Cat(input.string(), ": there is not enough memory for its Gaussians")};
}

}  // namespace anchorsplat

#include "formats/streamed_sog/streamed_sog_reader.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/json_asset.h"
#include "formats/sog/sog_reader.h"
#include "io/compression_ratio.h"
#include "io/json_file.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMaxIndex = uint64_t{256} << 20;
constexpr int kMostLevels = 256;

// A range of a chunk's Gaussians that belongs to a leaf.
struct Run {
  size_t file = 0;
  int64_t offset = 0, count = 0;
};

// Chunks are in the folder of the index or below.
bool StaysBelow(const std::string& name) {
  if (name.empty() || name.find_first_of("\\:") != name.npos || name.find('\0') != name.npos) return false;
  const std::filesystem::path path = name;
  return !path.is_absolute() && std::ranges::none_of(path, [](const std::filesystem::path& part) {
    return part.empty() || part == "." || part == "..";
  });
}

Result<std::string> ChunkName(const JsonValue& name) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::string text, name.Text());
  if (!StaysBelow(text)) {
    return name.Complain(Cat("expected the name of a file in folders below, found \"", Printable(text), "\""));
  }
  return text;
}

struct Index {
  JsonFile json;
  int levels = 0;
  std::vector<std::string> files;
  std::optional<std::string> environment;
};

Result<Index> ReadIndex(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, file.ReadAll(kMaxIndex));
  ANCHORSPLAT_ASSIGN_OR_RETURN(JsonFile json, JsonFile::Parse(file.name(), text));
  Index index{std::move(json), 0, {}, {}};
  const JsonValue root = index.json.root();
  if (const std::optional<JsonValue> version = root.Find("version")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int number, version->WholeNumber(0, std::numeric_limits<int>::max()));
    if (number > 1) return version->Complain(Cat("is ", number, "; only streamed SOG 1 is supported"));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue levels, root.Get("lodLevels"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(index.levels, levels.WholeNumber(1, kMostLevels));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue filenames, root.Get("filenames"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> names, filenames.Elements());
  for (const JsonValue& name : names) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::string chunk, ChunkName(name));
    index.files.push_back(std::move(chunk));
  }
  if (const std::optional<JsonValue> environment = root.Find("environment");
      environment && !environment->raw().is_null()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(index.environment, ChunkName(*environment));
  }
  return index;
}

// The level of a leaf to use for `level`; none if the leaf is empty.
std::optional<JsonValue> LevelOf(const JsonValue& lods, int level, int levels) {
  for (int finer = level; finer >= 0; --finer) {
    if (std::optional<JsonValue> found = lods.Find(Cat(finer).c_str())) return found;
  }
  for (int coarser = level + 1; coarser < levels; ++coarser) {
    if (std::optional<JsonValue> found = lods.Find(Cat(coarser).c_str())) return found;
  }
  return std::nullopt;
}

// Collects the leaves below a node in order. JsonFile limits the depth.
Status CollectRuns(const JsonValue& node, const Index& index, int level, std::vector<Run>& runs) {
  if (const std::optional<JsonValue> lods = node.Find("lods")) {
    if (!lods->raw().is_object()) return lods->Complain("expected the levels of a leaf");
    const std::optional<JsonValue> found = LevelOf(*lods, level, index.levels);
    if (!found) return {};
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue file, found->Get("file"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue offset, found->Get("offset"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue count, found->Get("count"));
    if (index.files.empty()) return file.Complain("names a chunk, but \"filenames\" has none");
    Run run;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int chunk, file.WholeNumber(0, static_cast<int>(index.files.size()) - 1));
    ANCHORSPLAT_ASSIGN_OR_RETURN(run.offset, offset.WholeNumber(0, 1 << 28));
    ANCHORSPLAT_ASSIGN_OR_RETURN(run.count, count.WholeNumber(0, 1 << 28));
    run.file = static_cast<size_t>(chunk);
    if (run.count > 0) runs.push_back(run);
    return {};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue children, node.Get("children"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> nodes, children.Elements());
  for (const JsonValue& child : nodes) ANCHORSPLAT_RETURN_IF_ERROR(CollectRuns(child, index, level, runs));
  return {};
}

// Ranges must not overlap: a small file could reference a chunk a million times.
Status CheckApart(const InputFile& file, const Index& index, std::vector<Run> runs) {
  std::ranges::sort(
      runs, [](const Run& a, const Run& b) { return std::pair(a.file, a.offset) < std::pair(b.file, b.offset); });
  for (size_t k = 1; k < runs.size(); ++k) {
    if (runs[k].file == runs[k - 1].file && runs[k].offset < runs[k - 1].offset + runs[k - 1].count) {
      return Error{ErrorCode::kBadFile, Cat(file.name(), ": two leaves share Gaussian ", runs[k].offset, " of ",
                                            Printable(index.files[runs[k].file]))};
    }
  }
  return {};
}

void CopyRun(const GaussianCloud& from, const Run& run, GaussianCloud& to, int64_t at) {
  const auto copy = [&](const Buffer<float>& source, Buffer<float>& target, int64_t width) {
    std::copy_n(source.begin() + run.offset * width, run.count * width, target.begin() + at * width);
  };
  copy(from.means, to.means, 3);
  copy(from.log_scales, to.log_scales, 3);
  copy(from.quats, to.quats, 4);
  copy(from.opacity_logits, to.opacity_logits, 1);
  const int64_t stride = from.sh_stride();
  for (int64_t i = 0; i < run.count; ++i) {
    float* const row = to.sh.data() + (at + i) * to.sh_stride();
    std::copy_n(from.sh.data() + (run.offset + i) * stride, stride, row);
    std::fill(row + stride, row + to.sh_stride(), 0.0f);
  }
}

void AddComments(const GaussianCloud& from, GaussianCloud& to) {
  for (const std::string& comment : from.comments) {
    if (std::ranges::find(to.comments, comment) == to.comments.end()) to.comments.push_back(comment);
  }
  if (!to.render_mode) to.render_mode = from.render_mode;
}

// Bytes of a chunk; 0 if it cannot be opened, which reading reports.
uint64_t ChunkSize(const InputFile& file, const std::string& name) {
  const Result<InputFile> chunk = file.OpenBeside(name);
  return chunk.ok() ? SogSize(*chunk) : 0;
}

}  // namespace

Result<GaussianCloud> ReadStreamedSog(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Index index, ReadIndex(file));
  if (limits.lod_level < 0 || limits.lod_level >= index.levels) {
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": has no level ", limits.lod_level, "; its levels are 0 to ", index.levels - 1)};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue tree, index.json.root().Get("tree"));
  std::vector<Run> runs;
  ANCHORSPLAT_RETURN_IF_ERROR(CollectRuns(tree, index, limits.lod_level, runs));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckApart(file, index, runs));
  uint64_t total = 0, compressed = 0;
  std::map<size_t, std::vector<std::pair<Run, int64_t>>> by_file;  // with each run's position in the cloud
  for (const Run& run : runs) {
    by_file[run.file].emplace_back(run, static_cast<int64_t>(total));
    total += static_cast<uint64_t>(run.count);
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(file.name(), total, limits));
  for (const auto& [chunk, unused] : by_file) compressed += ChunkSize(file, index.files[chunk]);
  // Means take at least four bytes each, which bounds the claimed size.
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCompressionRatio(file.name(), compressed, total * sizeof(float)));

  constexpr std::array<std::string_view, 9> kKnown = {"version",   "asset", "lodLevels",   "counts", "count",
                                                      "filenames", "tree",  "environment", "extras"};
  WarnOfAxisEntries(file.name(), OtherEntries(index.json.root(), kKnown));
  GaussianCloud cloud;
  for (const auto& [chunk, wanted] : by_file) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile part, file.OpenBeside(index.files[chunk]));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud gaussians, ReadSog(part, limits));
    if (cloud.empty()) {
      cloud.Resize(static_cast<int64_t>(total), gaussians.sh_degree);
    } else if (gaussians.sh_degree > cloud.sh_degree) {
      cloud = WithShDegree(cloud, gaussians.sh_degree);
    }
    for (const auto& [run, at] : wanted) {
      if (run.offset + run.count > gaussians.size()) {
        return Error{ErrorCode::kBadFile,
                     Cat(file.name(), ": a leaf has Gaussians ", run.offset, " to ", run.offset + run.count, " of ",
                         Printable(index.files[chunk]), ", which has ", WithThousands(gaussians.size()))};
      }
      CopyRun(gaussians, run, cloud, at);
    }
    AddComments(gaussians, cloud);
  }
  if (index.environment) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile part, file.OpenBeside(*index.environment));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud gaussians, ReadSog(part, limits));
    ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(file.name(), total + static_cast<uint64_t>(gaussians.size()), limits));
    ANCHORSPLAT_RETURN_IF_ERROR(Append(cloud, gaussians));
    AddComments(gaussians, cloud);
  }
  // For all chunks, which have none of their own.
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<std::string> said, CommentsOfAsset(index.json.root()));
  cloud.origin = TakeOrigin(said);
  return cloud;
}

uint64_t StreamedSogSize(const InputFile& file) {
  uint64_t sum = file.size();
  const Result<Index> index = ReadIndex(file);
  if (!index.ok()) return sum;
  for (const std::string& name : index->files) sum += ChunkSize(file, name);
  return index->environment ? sum + ChunkSize(file, *index->environment) : sum;
}

Result<FormatFacts> DescribeStreamedSog(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Index index, ReadIndex(file));
  const JsonValue root = index.json.root();
  FormatFacts facts;
  facts.Add("version", root.has("version") ? "1" : "before 1");
  std::string counts;
  if (const std::optional<JsonValue> list = root.Find("counts")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> numbers, list->Elements());
    for (const JsonValue& number : numbers) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const int count, number.WholeNumber(0, std::numeric_limits<int>::max()));
      counts += Cat(counts.empty() ? ": " : ", ", WithThousands(count));
    }
  }
  facts.Add("levels of detail", index.levels, counts, counts.empty() ? "" : " Gaussians; the finest is read");
  facts.Add("chunks", index.files.size(), index.environment ? " and an environment" : "");
  if (const std::optional<JsonValue> asset = root.Find("asset"); asset && asset->has("generator")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue generator, asset->Get("generator"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, generator.Text());
    facts.Add("made by", Printable(name));
  }
  return facts;
}

}  // namespace anchorsplat

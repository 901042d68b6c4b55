#include "formats/streamed_sog/streamed_sog_writer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/file_system.h"
#include "core/log.h"
#include "core/number_text.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/json_asset.h"
#include "formats/sog/sog_writer.h"
#include "formats/streamed_sog/coarser_cloud.h"
#include "formats/streamed_sog/lod_tree.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "io/json_file.h"
#include "io/staged_folder.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using OrderedJson = nlohmann::ordered_json;

constexpr std::string_view kIndexName = "lod-meta.json";

// Location of a leaf's level.
struct LeafRange {
  int64_t chunk = 0;  // within the level
  int64_t offset = 0;
  int64_t count = 0;
};

struct Box {
  std::array<double, 3> min, max;
  Box() {
    min.fill(std::numeric_limits<double>::infinity());
    max.fill(-std::numeric_limits<double>::infinity());
  }
  void Add(const Box& other) {
    for (size_t k = 0; k < 3; ++k) {
      min[k] = std::min(min[k], other.min[k]);
      max[k] = std::max(max[k], other.max[k]);
    }
  }
};

// Bounds of the one-standard-deviation ellipsoids, as in other writers.
Box BoxOf(const CloudView& cloud) {
  Box box;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const float* q = cloud.quats.data() + 4 * i;
    const std::array<double, 9> axes = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
    for (size_t k = 0; k < 3; ++k) {
      double variance = 0;
      for (size_t axis = 0; axis < 3; ++axis) {
        const double log_scale = std::min(double{cloud.log_scales[static_cast<size_t>(3 * i) + axis]}, 20.0);
        const double length = axes[3 * k + axis] * std::exp(log_scale);
        variance += length * length;
      }
      const double mean = cloud.means[static_cast<size_t>(3 * i) + k], reach = std::sqrt(variance);
      box.min[k] = std::min(box.min[k], mean - reach);
      box.max[k] = std::max(box.max[k], mean + reach);
    }
  }
  return box;
}

// Rounds outwards to 7 significant digits, as the format requires.
double RoundedAway(double x, double sign) {
  if (x == 0) return 0;
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, x, std::chars_format::scientific, 6).ptr;
  double rounded = x;
  FromChars(text, end, rounded);
  if (sign * rounded >= sign * x) return rounded;
  const double step = std::pow(10.0, std::floor(std::log10(std::fabs(x))) - 6);
  const auto further = std::to_chars(text, text + sizeof text, x + sign * step, std::chars_format::scientific, 6).ptr;
  FromChars(text, further, rounded);
  return rounded;
}

OrderedJson BoundJson(const Box& box) {
  OrderedJson min = OrderedJson::array(), max = OrderedJson::array();
  for (size_t k = 0; k < 3; ++k) {
    min.push_back(RoundedAway(box.min[k], -1));
    max.push_back(RoundedAway(box.max[k], 1));
  }
  return {{"min", min}, {"max", max}};
}

// All levels of a leaf, finest first; fewer if one is down to a single Gaussian.
std::vector<GaussianCloud> LevelsOf(GaussianCloud finest, const LodOptions& options) {
  std::vector<GaussianCloud> levels;
  levels.push_back(std::move(finest));
  for (int level = 1; level < options.levels; ++level) {
    const auto target = static_cast<int64_t>(std::ceil(static_cast<double>(levels.back().size()) * options.ratio));
    levels.push_back(CoarsenCloud(levels.back(), target));
  }
  return levels;
}

// Chunks of the levels, filled leaf by leaf.
class ChunkWriter {
 public:
  // Folders are created in `folder`, or in options.memory under that name.
  ChunkWriter(fs::path folder, const CloudWriteOptions& options)
      : folder_(std::move(folder)), options_(options), levels_(static_cast<size_t>(options.lod.levels)) {}

  Result<LeafRange> Add(size_t level, const GaussianCloud& part) {
    Level& at = levels_[level];
    if (at.open.size() + part.size() > int64_t{1024} * options_.lod.chunk_count) {
      ANCHORSPLAT_RETURN_IF_ERROR(Close(level));
    }
    if (at.open.empty()) at.open.sh_degree = part.sh_degree;
    const LeafRange range{at.chunks, at.open.size(), part.size()};
    ANCHORSPLAT_RETURN_IF_ERROR(Append(at.open, part));
    at.open.render_mode = part.render_mode;
    at.open.comments = part.comments;
    at.count += part.size();
    return range;
  }

  Status Finish() {
    for (size_t level = 0; level < levels_.size(); ++level) ANCHORSPLAT_RETURN_IF_ERROR(Close(level));
    return {};
  }

  int64_t count(size_t level) const { return levels_[level].count; }

  // "0_0", "0_1", …, "1_0": all chunks by level.
  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (size_t level = 0; level < levels_.size(); ++level) {
      for (int64_t chunk = 0; chunk < levels_[level].chunks; ++chunk) names.push_back(Cat(level, "_", chunk));
    }
    return names;
  }
  // Index of a chunk in Names().
  int64_t IndexOf(size_t level, int64_t chunk) const {
    for (size_t finer = 0; finer < level; ++finer) chunk += levels_[finer].chunks;
    return chunk;
  }

 private:
  struct Level {
    GaussianCloud open;
    int64_t chunks = 0;  // chunks written
    int64_t count = 0;   // Gaussians, including those in `open`
  };

  Status Close(size_t level) {
    Level& at = levels_[level];
    if (at.open.empty()) return {};
    if (StopRequested()) return Error{ErrorCode::kInterrupted, "stopped: nothing was written"};
    const fs::path folder = folder_ / Cat(level, "_", at.chunks);
    if (options_.memory == nullptr) {
      std::error_code failed;
      fs::create_directory(folder, failed);
      if (failed) return Error{ErrorCode::kIo, Cat(folder.string(), ": cannot create this folder: ", failed.message())};
    }
    CloudWriteOptions as_they_come = options_;
    as_they_come.order = SplatOrder::kKeep;
    ANCHORSPLAT_RETURN_IF_ERROR(WriteSog(folder / "meta.json", at.open, as_they_come));
    at.open = {};
    ++at.chunks;
    return {};
  }

  fs::path folder_;
  const CloudWriteOptions& options_;
  std::vector<Level> levels_;
};

// JSON of a leaf.
struct LeafFacts {
  Box box;
  std::vector<LeafRange> levels;
};

// Processes as many leaves in parallel as there are threads; written in order.
Result<std::vector<LeafFacts>> WriteLeaves(const CloudView& cloud, const LodTree& tree,
                                           const std::vector<int64_t>& leaves, const LodOptions& options,
                                           ChunkWriter& chunks) {
  const auto at_once = static_cast<size_t>(std::max(1, ThreadCount()));
  Progress progress("levels of detail", static_cast<int64_t>(leaves.size()));
  std::vector<LeafFacts> facts(leaves.size());
  for (size_t next = 0; next < leaves.size(); next += at_once) {
    std::vector<std::vector<GaussianCloud>> parts(std::min(at_once, leaves.size() - next));
    ParallelFor(0, static_cast<int64_t>(parts.size()), 1, [&](int64_t first, int64_t last) {
      for (auto k = static_cast<size_t>(first); k < static_cast<size_t>(last); ++k) {
        const LodTree::Node& leaf = tree.nodes[static_cast<size_t>(leaves[next + k])];
        parts[k] = LevelsOf(GaussiansAt(cloud, tree.rows.data() + leaf.begin, leaf.end - leaf.begin), options);
        for (const GaussianCloud& level : parts[k]) facts[next + k].box.Add(BoxOf(level));
      }
    });
    for (size_t k = 0; k < parts.size(); ++k) {
      for (size_t level = 0; level < parts[k].size(); ++level) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(const LeafRange range, chunks.Add(level, parts[k][level]));
        facts[next + k].levels.push_back(range);
      }
      progress.Advance();
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(chunks.Finish());
  return facts;
}

// JSON of the tree below a node, and its bounds.
OrderedJson TreeJson(const LodTree& tree, int64_t at, const std::vector<int64_t>& leaves,
                     const std::vector<LeafFacts>& facts, const ChunkWriter& chunks, Box& box) {
  const LodTree::Node& node = tree.nodes[static_cast<size_t>(at)];
  OrderedJson json = {{"bound", nullptr}};
  if (node.is_leaf()) {
    const auto leaf = static_cast<size_t>(std::ranges::lower_bound(leaves, at) - leaves.begin());
    box = facts[leaf].box;
    OrderedJson lods = OrderedJson::object();
    for (size_t level = 0; level < facts[leaf].levels.size(); ++level) {
      const LeafRange& range = facts[leaf].levels[level];
      lods[Cat(level)] = {
          {"file", chunks.IndexOf(level, range.chunk)}, {"offset", range.offset}, {"count", range.count}};
    }
    json["lods"] = std::move(lods);
  } else {
    Box right;
    OrderedJson children = OrderedJson::array();
    children.push_back(TreeJson(tree, node.left, leaves, facts, chunks, box));
    children.push_back(TreeJson(tree, node.right, leaves, facts, chunks, right));
    box.Add(right);
    json["children"] = std::move(children);
  }
  json["bound"] = BoundJson(box);
  return json;
}

// Chunk folders of the existing scene: only plain names, as only ours may be removed.
std::vector<fs::path> OldChunks(const fs::path& index) {
  std::vector<fs::path> folders;
  if (!IsFile(index)) return folders;
  RecordOwnFile(index);  // it is replaced, not an input
  const Result<JsonFile> json = JsonFile::Read(index);
  const std::optional<JsonValue> names = json.ok() ? json->root().Find("filenames") : std::nullopt;
  if (!names || !names->raw().is_array()) return folders;
  for (const nlohmann::json& name : names->raw()) {
    if (!name.is_string()) continue;
    const fs::path chunk = name.get<std::string>();
    const fs::path folder = chunk.parent_path();
    const bool plain = chunk.filename() == "meta.json" && !folder.empty() && !folder.has_parent_path() &&
                       folder != "." && folder != "..";
    if (plain) folders.push_back(index.parent_path() / folder);
  }
  return folders;
}

// Removes only the files of a SOG; a folder with anything else stays.
void RemoveChunk(const fs::path& folder) {
  std::error_code ignored;
  if (fs::symlink_status(folder, ignored).type() != fs::file_type::directory) return;
  fs::remove(folder / "meta.json", ignored);
  for (const char* picture : SogPictures(kMaxShDegree)) fs::remove(folder / picture, ignored);
  fs::remove(folder, ignored);
}

// Adds a suffix so that no name exists: "0_0", or "0_0-2" for all.
std::vector<std::string> FreeNames(const fs::path& folder, const std::vector<std::string>& names) {
  for (int number = 1;; ++number) {
    std::vector<std::string> free;
    for (const std::string& name : names) free.push_back(number == 1 ? name : Cat(name, "-", number));
    const auto taken = [&](const std::string& name) {
      std::error_code ignored;
      return fs::symlink_status(folder / name, ignored).type() != fs::file_type::not_found;
    };
    if (std::ranges::none_of(free, taken)) return free;
  }
}

// A folder created for the output, removed again if unused.
class MadeFolder {
 public:
  static Result<MadeFolder> Make(const fs::path& folder) {
    MadeFolder made;
    if (folder.empty() || Exists(folder)) return made;
    std::error_code failed;
    fs::create_directory(folder, failed);
    if (failed)
      return Error{ErrorCode::kNotFound, Cat(folder.string(), ": cannot create this folder: ", failed.message())};
    made.folder_ = folder;
    return made;
  }
  MadeFolder(MadeFolder&& other) noexcept : folder_(std::move(other.folder_)) { other.folder_.clear(); }
  MadeFolder& operator=(MadeFolder&&) = delete;
  ~MadeFolder() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove(folder_, ignored);  // only if empty
  }

 private:
  MadeFolder() = default;
  fs::path folder_;
};

Status CheckLodOptions(const fs::path& path, const LodOptions& lod) {
  if (path.filename() != kIndexName) {
    return Error{ErrorCode::kBadArgument, Cat(path.string(), ": a streamed SOG must be named ", kIndexName)};
  }
  if (lod.levels >= 1 && lod.levels <= 16 && lod.ratio > 0 && lod.ratio < 1 && lod.chunk_count >= 1 &&
      lod.chunk_count <= 1 << 17 && lod.chunk_extent > 0) {
    return {};
  }
  return Error{ErrorCode::kBadArgument,
               Cat(path.string(),
                   ": expected 1 to 16 levels, a ratio between 0 and 1, chunks of 1 to 131,072 thousand "
                   "Gaussians and a positive extent")};
}

}  // namespace

Buffer<uint32_t> StreamedSogRows(const CloudView& cloud, const CloudWriteOptions& options) {
  return BuildLodTree(cloud, options.lod).rows;
}

Status WriteStreamedSog(const fs::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckLodOptions(path, options.lod));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, cloud));
  const bool in_memory = options.memory != nullptr;
  const fs::path parent = path.parent_path();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const MadeFolder made, MadeFolder::Make(in_memory ? fs::path() : parent));
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile index, OutputFile::Create(path, options.overwrite, options.memory));
  std::optional<StagedFolder> staged;
  std::vector<fs::path> old;
  if (!in_memory) {
    old = OldChunks(path);
    ANCHORSPLAT_ASSIGN_OR_RETURN(StagedFolder folder, StagedFolder::Create(path));
    staged.emplace(std::move(folder));
  }

  const LodTree tree = BuildLodTree(cloud, options.lod);
  if (tree.rows.empty()) {
    return Error{ErrorCode::kBadArgument, Cat(path.string(), ": all of the ", WithThousands(cloud.size()),
                                              " Gaussians have NaN or infinite values: nothing to write")};
  }
  if (const int64_t dropped = cloud.size() - static_cast<int64_t>(tree.rows.size()); dropped > 0) {
    LogWarning(Cat(path.string(), ": ", WithThousands(dropped), " of ", WithThousands(cloud.size()), " Gaussians have ",
                   kWhyUnusable, " and cannot be placed in the tree: dropped"));
  }
  const std::vector<int64_t> leaves = LeavesOf(tree);
  ChunkWriter chunks(staged ? staged->path() : parent, options);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<LeafFacts> facts,
                               WriteLeaves(cloud, tree, leaves, options.lod, chunks));

  const std::vector<std::string> names = chunks.Names();
  const std::vector<std::string> published = staged ? FreeNames(parent, names) : names;
  OrderedJson counts = OrderedJson::array(), filenames = OrderedJson::array();
  int64_t sum = 0;
  std::string spoken;
  for (size_t level = 0; level < static_cast<size_t>(options.lod.levels); ++level) {
    counts.push_back(chunks.count(level));
    sum += chunks.count(level);
    spoken += Cat(level == 0 ? "" : ", ", WithThousands(chunks.count(level)));
  }
  for (const std::string& name : published) filenames.push_back(name + "/meta.json");
  Box box;
  OrderedJson root = TreeJson(tree, 0, leaves, facts, chunks, box);
  const OrderedJson json = {{"version", 1},
                            {"asset", OrderedJson(AssetOf(cloud.comments, cloud.origin))},
                            {"count", sum},
                            {"counts", std::move(counts)},
                            {"lodLevels", options.lod.levels},
                            {"filenames", std::move(filenames)},
                            {"tree", std::move(root)}};
  ANCHORSPLAT_RETURN_IF_ERROR(index.Write(json.dump()));
  if (staged) ANCHORSPLAT_RETURN_IF_ERROR(staged->Publish(names, published));
  ANCHORSPLAT_RETURN_IF_ERROR(index.Commit());
  if (staged) staged->Keep();
  for (const fs::path& folder : old) {
    const bool new_one =
        std::ranges::any_of(published, [&](const std::string& name) { return folder == parent / name; });
    if (!new_one) RemoveChunk(folder);
  }
  LogInfo(Cat(path.string(), ": ", options.lod.levels, " levels of ", spoken, " Gaussians, ", leaves.size(),
              leaves.size() == 1 ? " leaf, " : " leaves, ", names.size(), " chunks"));
  return {};
}

uint64_t EstimatedStreamedSogSize(int64_t count, int sh_degree) {
  const LodOptions lod;
  const int64_t chunk = int64_t{1024} * lod.chunk_count;
  double bytes = 0;
  auto left = static_cast<double>(count);
  for (int level = 0; level < lod.levels; ++level, left *= lod.ratio) {
    const auto gaussians = static_cast<int64_t>(std::ceil(left));
    bytes += static_cast<double>(gaussians / chunk) * static_cast<double>(EstimatedSogSize(chunk, sh_degree));
    if (gaussians % chunk > 0) bytes += static_cast<double>(EstimatedSogSize(gaussians % chunk, sh_degree));
  }
  return static_cast<uint64_t>(bytes);
}

}  // namespace anchorsplat

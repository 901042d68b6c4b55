#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/region.h"
#include "core/render_mode.h"
#include "core/result.h"
#include "core/similarity.h"

namespace anchorsplat {

// Rows of the table of readings (docs/reading.md): a splat's features, what improves it, and what the program does with
// it by itself.

// Folds of the table by mesh or maker, for cross-validation.
inline constexpr int kReadingFolds = 8;

// A splat for which to make a row.
struct ReadingTask {
  std::string id;
  // Known facts about the splat, copied to its row: original, mesh, maker, kind, edit, made.
  std::array<std::string, 6> labels;
  std::filesystem::path splat;
  // What it was fitted to: an object of a benchmark (eval/benchmark.h), or a project of photographs that were reduced
  // by `downscale` (above 1). Its cameras give the true pixel sizes. Empty: unknown, and the row has no gains.
  std::filesystem::path object;
  int downscale = 1;
  bool measure = true;  // false: uses the object only for true pixel sizes, which needs no pictures
  int places = 0;       // adds features and true pixel sizes of this many evenly chosen places (reading/places.h)
  // If set, computes only the program's own decision with this model, and its gain.
  std::filesystem::path model;
  // Training pixel size (world units) of rows from `others_from` on, which were merged in from something else; the
  // cameras' applies to the rows before. 0: none.
  int64_t others_from = 0;
  double others_pixel = 0;
  // For parts of a splat, or splats with additions: what to render beside it (filtered at its own pixel size), and the
  // region to render of the splat and its results. Both in the splat's world.
  std::filesystem::path context;
  std::optional<Region> keep;
  Similarity moved;   // from the object's world to the splat's
  std::string words;  // all of the above as given
};
inline constexpr std::array<const char*, 6> kReadingLabels = {"original", "mesh", "maker", "kind", "edit", "made"};

// kBadFile: an id that cannot be a file name, no splat, wrong types, invalid values, unknown properties.
Result<ReadingTask> ReadingTaskFrom(const nlohmann::json& json);
// Reads one JSON task per line, with distinct ids. Errors: kNotFound, kIo, kBadFile naming the line.
Result<std::vector<ReadingTask>> ReadReadingTasks(const std::filesystem::path& path);

// Makes rows. Caches the last object, with the pictures of `views` held-out views.
class ReadingRows {
 public:
  explicit ReadingRows(int views);
  ~ReadingRows();

  // Fingerprint of what a row depends on besides the program: the task, its files' current versions, the number of
  // views. Stored in the row as "state", so that outdated rows are made again.
  std::string StateOf(const ReadingTask& task) const;

  // Makes a row for the table. Errors: those of reading and of processing the splat; kBadFile: others_from beyond the
  // last Gaussian, or a region without Gaussians.
  Result<nlohmann::json> Make(const ReadingTask& task);

 private:
  struct Object;
  Result<const Object*> Open(const ReadingTask& task);

  int views_;
  std::unique_ptr<Object> object_;
};

}  // namespace anchorsplat

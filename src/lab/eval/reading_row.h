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

// Rows of the table of readings (docs/reading.md): what a splat looks like, what helps it, and what the program
// does with it by itself.

// Parts of the table, by mesh or maker: what decides one has learned from the others.
inline constexpr int kReadingFolds = 8;

// A splat of which a row is to be made.
struct ReadingTask {
  std::string id;
  // What is known of the splat, carried into its row as it is: original, mesh, maker, kind, edit, made.
  std::array<std::string, 6> labels;
  std::filesystem::path splat;
  // What it was fitted to: an object of a benchmark (eval/benchmark.h), or a project of photographs whose pictures were
  // averaged down by `downscale` (above 1). Its cameras say the true pixels. Empty: nobody knows, and the row has no
  // gains.
  std::filesystem::path object;
  int downscale = 1;
  bool measure = true;  // false: of the object only the true pixels are asked for, which takes no pictures
  int places = 0;  // of so many, evenly drawn, the row has what they look like and their true pixels (reading/places.h)
  // Only what the program does by itself is asked for, with this model, and what it gains.
  std::filesystem::path model;
  // World size of the training pixels of the rows from `others_from` on, which are of something else that was merged
  // in; all others have those that the cameras say. 0: there are none.
  int64_t others_from = 0;
  double others_pixel = 0;
  // Where the splat is a part of something, or something was added to it: what is drawn beside it, filtered at its own
  // pixels, and what is drawn of the splat and its results alone. Both in the splat's own world.
  std::filesystem::path context;
  std::optional<Region> keep;
  Similarity moved;   // the object's world → the splat's
  std::string words;  // all of that, as it was given
};
inline constexpr std::array<const char*, 6> kReadingLabels = {"original", "mesh", "maker", "kind", "edit", "made"};

// kBadFile: no id that can be a file's name, no splat, values of other types or that mean nothing, unknown properties.
Result<ReadingTask> ReadingTaskFrom(const nlohmann::json& json);
// A line of JSON per task, each with an id of its own. Errors: kNotFound, kIo, kBadFile naming the line.
Result<std::vector<ReadingTask>> ReadReadingTasks(const std::filesystem::path& path);

// Makes rows. Keeps the object that was looked at last, with the pictures of `views` held-out views of it.
class ReadingRows {
 public:
  explicit ReadingRows(int views);
  ~ReadingRows();

  // What a row depends on besides the program: the task, its files as they are now, the number of views. In a row as
  // "state", so that one that was made of something else is made anew.
  std::string StateOf(const ReadingTask& task) const;

  // The row as the table keeps it. Errors: of reading, and of what the splat is asked; kBadFile: others that begin
  // behind the last Gaussian, a region that keeps none.
  Result<nlohmann::json> Make(const ReadingTask& task);

 private:
  struct Object;
  Result<const Object*> Open(const ReadingTask& task);

  int views_;
  std::unique_ptr<Object> object_;
};

}  // namespace anchorsplat

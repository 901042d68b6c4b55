#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "eval/capture.h"
#include "eval/method.h"
#include "eval/method_result.h"
#include "perceptual/lpips.h"

namespace anchorsplat {

struct EvaluationOptions {
  Protocol protocol = Protocol::kHeldOut;
  std::string split = {};                 // of the data set; empty: all objects
  std::vector<std::string> objects = {};  // names; empty: all
  std::vector<std::string> kinds = {};    // of objects (BenchmarkEntry::kind); empty: all
  // Set if the benchmark is a folder of captures: how they become objects. Results are then stored per method, not per
  // object.
  std::optional<CaptureRecipe> captures = std::nullopt;
  size_t max_views = 0;  // per object, evenly chosen from the protocol's; 0: all, as the protocol demands
  const Lpips* lpips = nullptr;
  uint64_t seed = 0;
  bool again = false;  // measures again despite existing results
};

// An object or method that could not be measured.
struct EvaluationFailure {
  std::string object;
  std::string method;  // empty: the object itself failed
  std::string message;
};

// Wall-clock seconds of this run.
struct EvaluationTimes {
  double truth = 0, render = 0, metrics = 0, lpips = 0;
  int64_t pictures = 0;  // measured; `truth` is read once for all methods
};

struct Evaluation {
  Protocol protocol = Protocol::kHeldOut;
  size_t max_views = 0;
  std::optional<LpipsNet> lpips;
  std::vector<std::string> methods;               // in the requested order
  std::vector<std::string> objects;               // by name
  std::vector<std::string> kinds;                 // of each object; empty if unknown
  std::vector<std::vector<std::string>> credits;  // of each object, from its splat (core/splat_comments.h)
  std::vector<MethodResult> results;              // by object, then method, without failed ones
  std::vector<EvaluationFailure> failures;
  EvaluationTimes times;
  int64_t resumed = 0;  // results that existed already

  const MethodResult* Find(const std::string& object, const std::string& method) const;
};

// Measures `methods` on the objects of `benchmark`. Stores each result as out/objects/OBJECT/METHOD.json once the
// object is done, with METHOD.png and truth.png: the excerpt of a view where the low-quality splat differs most from
// the truth. Reuses results of the same splat made in the same way. Fits of captures are in out/objects/OBJECT/fit/.
//
// A failing object or method is recorded in `failures` and does not stop the others. Errors: kNotFound; kBadArgument:
// no objects, unknown names or kinds, two methods of one name; kIo: `out` cannot be written.
Result<Evaluation> Evaluate(const std::filesystem::path& benchmark, const std::vector<EvalMethod>& methods,
                            const std::filesystem::path& out, const EvaluationOptions& options);

// Names of the objects that Evaluate would measure. Errors: as Evaluate's kNotFound and kBadArgument for objects.
Result<std::vector<std::string>> ObjectsToEvaluate(const std::filesystem::path& benchmark,
                                                   const EvaluationOptions& options);

// Folder out/objects/OBJECT/, and the file name stem of a method in it.
std::filesystem::path ObjectFolder(const std::filesystem::path& out, const std::string& object);
std::string FileStem(const std::string& method);
inline constexpr const char* kTruthStem = "truth";

}  // namespace anchorsplat

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
  // The benchmark is a folder of captures, of which this makes objects; each method's result is kept as soon as it is
  // measured, not all of an object at once.
  std::optional<CaptureRecipe> captures = std::nullopt;
  size_t max_views = 0;  // per object, evenly spread over the protocol's; 0: all, which the protocol means
  const Lpips* lpips = nullptr;
  uint64_t seed = 0;
  bool again = false;  // measure what there are results of, too
};

// Something that could not be measured; the others were.
struct EvaluationFailure {
  std::string object;
  std::string method;  // empty: the object itself
  std::string message;
};

// Seconds on the clock, of what this run measured.
struct EvaluationTimes {
  double truth = 0, render = 0, metrics = 0, lpips = 0;
  int64_t pictures = 0;  // measured; `truth` is read once for all methods
};

struct Evaluation {
  Protocol protocol = Protocol::kHeldOut;
  size_t max_views = 0;
  std::optional<LpipsNet> lpips;
  std::vector<std::string> methods;  // in the order asked for
  std::vector<std::string> objects;  // in order of their names
  std::vector<std::string> kinds;    // of each object; empty words where nothing says
  std::vector<std::vector<std::string>>
      credits;                        // of each object: whose it is, as its splat says (core/splat_comments.h)
  std::vector<MethodResult> results;  // object by object, method by method; those that failed are not there
  std::vector<EvaluationFailure> failures;
  EvaluationTimes times;
  int64_t resumed = 0;  // results that were there already

  const MethodResult* Find(const std::string& object, const std::string& method) const;
};

// Measures `methods` on the objects of `benchmark`. In `out` each result becomes out/objects/OBJECT/METHOD.json as soon
// as the object is done, beside METHOD.png and truth.png: the same part of the same view, where the low-quality splat
// is farthest from the truth. Results that are there, and were made from the same splat in the same way, are not made
// again. Fits of captures lie in out/objects/OBJECT/fit/.
//
// An object or method that fails is listed in `failures` and does not stop the others. Errors: kNotFound, kBadArgument
// (no objects, names or kinds that are not there, two methods of one name), kIo (`out` cannot be written).
Result<Evaluation> Evaluate(const std::filesystem::path& benchmark, const std::vector<EvalMethod>& methods,
                            const std::filesystem::path& out, const EvaluationOptions& options);

// The objects that Evaluate would measure, by name. Errors: its kNotFound and kBadArgument, about objects.
Result<std::vector<std::string>> ObjectsToEvaluate(const std::filesystem::path& benchmark,
                                                   const EvaluationOptions& options);

// out/objects/OBJECT/, and the name of a method's files in it.
std::filesystem::path ObjectFolder(const std::filesystem::path& out, const std::string& object);
std::string FileStem(const std::string& method);
inline constexpr const char* kTruthStem = "truth";

}  // namespace anchorsplat

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "eval/evaluation.h"

namespace anchorsplat {

// A mean over objects with its 95 % bootstrap interval: percentiles of 10,000 resamples of the objects with
// replacement.
struct Interval {
  double mean = 0;
  double low = 0;
  double high = 0;
};

// A method's row. Gains and wins cover the objects for which both methods have results.
struct MethodSummary {
  std::string method;
  int64_t objects = 0;
  Interval psnr;  // dB; infinite if a picture was identical to the truth
  Interval ssim;
  std::optional<Interval> lpips;          // if all of its results have it
  std::optional<Interval> gain_over_raw;  // dB
  std::optional<Interval> gain_over_filter;
  int64_t compared_with_filter = 0;  // objects
  int64_t wins_over_filter = 0;      // of these, with higher PSNR
  double seconds = 0;                // of the method, mean per object
  double gaussians = 0;              // mean per object; 0: no splat
};

// One row per method with results, in the evaluation's order. The protocol decides whether pictures or objects weigh
// equally. Intervals depend only on the data and the seed.
std::vector<MethodSummary> Summarise(const Evaluation& evaluation, uint64_t seed);

// The object on which a method gained least over another.
struct WorstObject {
  std::string object;
  std::string method;
  std::string kind;
  std::string over;  // "raw", or "filter" if raw was not measured
  double gain = 0;   // dB, of mean PSNRs; negative: a loss
};

// A method's summary on one kind of object.
struct KindSummary {
  std::string kind;
  MethodSummary summary;
  std::optional<WorstObject> worst;  // unset for "raw", and without a method to compare with
};

// By kind name, then method as in Summarise. Empty if all objects are of one kind or of unknown kind.
std::vector<KindSummary> SummariseKinds(const Evaluation& evaluation, uint64_t seed);

// The least gain over raw of all methods and objects; unset without raw or other methods.
std::optional<WorstObject> WorstOverRaw(const Evaluation& evaluation);

// Kind of an object in `evaluation`; empty if unknown.
std::string KindOf(const Evaluation& evaluation, const std::string& object);

// Weighted mean and its bootstrap interval. At least one value; positive weights.
Interval BootstrapMean(const std::vector<double>& values, const std::vector<double>& weights, uint64_t seed);

// Error of pixel sizes read by "filter-auto", |read/true − 1|: median and 95th percentile over the objects.
struct PixelSizeError {
  int64_t objects = 0;
  double median = 0;
  double percentile95 = 0;
};
std::optional<PixelSizeError> SummarisePixelSizes(const Evaluation& evaluation);

}  // namespace anchorsplat

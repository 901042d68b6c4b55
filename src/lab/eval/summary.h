#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "eval/evaluation.h"

namespace anchorsplat {

// A mean over objects with the middle 95 % of what it would have been with other objects of the same kind: percentiles
// of 10,000 bootstrap samples, objects drawn with replacement.
struct Interval {
  double mean = 0;
  double low = 0;
  double high = 0;
};

// A method's row. Gains and wins compare with another method on the objects that both have results for.
struct MethodSummary {
  std::string method;
  int64_t objects = 0;
  Interval psnr;  // dB; infinite when a picture was identical with the truth
  Interval ssim;
  std::optional<Interval> lpips;          // where all of its results have it
  std::optional<Interval> gain_over_raw;  // dB
  std::optional<Interval> gain_over_filter;
  int64_t compared_with_filter = 0;  // objects
  int64_t wins_over_filter = 0;      // of them, with a higher PSNR
  double seconds = 0;                // of the method, mean per object
  double gaussians = 0;              // mean per object; 0: there is no splat
};

// One row per method that has results, in the evaluation's order. The protocol decides how pictures are weighed: all
// alike, or every object alike. The same seed gives the same intervals.
std::vector<MethodSummary> Summarise(const Evaluation& evaluation, uint64_t seed);

// The object on which a method gained least over another one.
struct WorstObject {
  std::string object;
  std::string method;
  std::string kind;
  std::string over;  // "raw", or "filter" where raw was not measured
  double gain = 0;   // dB, of mean PSNRs; negative: it lost
};

// A method on the objects of one kind.
struct KindSummary {
  std::string kind;
  MethodSummary summary;
  std::optional<WorstObject> worst;  // nothing for "raw", and where there is nothing to compare with
};

// Kind by kind in the order of their names, method by method as Summarise. Nothing when the objects are of one kind, or
// nothing says of which.
std::vector<KindSummary> SummariseKinds(const Evaluation& evaluation, uint64_t seed);

// Of all methods and objects the least gain over raw; nothing where raw or all else is missing.
std::optional<WorstObject> WorstOverRaw(const Evaluation& evaluation);

// Of the object, as `evaluation` has it; empty where nothing says.
std::string KindOf(const Evaluation& evaluation, const std::string& object);

// Mean of values with weights, and its bootstrap interval. At least one value, weights positive.
Interval BootstrapMean(const std::vector<double>& values, const std::vector<double>& weights, uint64_t seed);

// How far pixel sizes were read off the truth, |read/true − 1|, of the results of "filter-auto": median and 95th
// percentile over the objects.
struct PixelSizeError {
  int64_t objects = 0;
  double median = 0;
  double percentile95 = 0;
};
std::optional<PixelSizeError> SummarisePixelSizes(const Evaluation& evaluation);

}  // namespace anchorsplat

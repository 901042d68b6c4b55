#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "reading/features.h"
#include "reading/reading_model.h"
#include "reading/showing_gaussians.h"

namespace anchorsplat {

// So much more a decibel that is lost counts than one that is gained: so that no more than about 2 % of the splats lose
// 0.1 dB (docs/reading.md). And a splat that is wrongly left alone than one that is wrongly enhanced.
inline constexpr double kLossesCount = 8;

// What a splat says of itself: how it was made, how large its training pixels were, and what would help it. Told by a
// model that has learned from splats of which all that is known (docs/reading.md).
struct Reading {
  double pixel = 0;                       // training pixel at the subject, world units
  double low = 0, high = 0;               // holds it for four splats in five of kinds that were learned from
  std::array<double, kMadeCount> made{};  // probabilities of Made
  double strangeness = 0;  // ReadingModel::Strangeness: above 1, 2 % of splats like those learned from are
  double unit = 0;         // world units, of `opinions`
  double showing = 1;      // share of the Gaussians that show, opacity of 10 % or more
  std::vector<ReadingOpinion> opinions;

  // What it is taken for: the likeliest. A splat of which more could be got is wronged by a word that says that it has
  // its width, which counts kLossesCount times; such a word needs 89 % for all that have theirs together.
  Made likeliest() const;
  double probability(Made of) const { return made[static_cast<size_t>(of)]; }
};

// "a classic splat (98 %)": likeliest() and how sure that is, never wholly.
std::string LooksInWords(const Reading& reading);

// kBadArgument: too little of the splat shows to be read. Other models than the program's are for measuring.
Result<Reading> Read(const CloudView& cloud, const ReadingModel& model = ReadingModel::Shipped());
// `showing`: FindShowingGaussians(cloud).
Result<Reading> Read(const CloudView& cloud, const ShowingGaussians& showing,
                     const ReadingModel& model = ReadingModel::Shipped());
// Of features that are known.
Reading ReadFrom(const SplatFeatures& features, const ReadingModel& model);

}  // namespace anchorsplat

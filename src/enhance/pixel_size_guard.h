#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/pixel_size_estimate.h"
#include "enhance/showing_gaussians.h"
#include "enhance/two_sides.h"

namespace anchorsplat {

// First, do no harm. An estimate of a training pixel that is too large blurs what was sharp, one that is too small
// gives back less width than was lost; so the estimate of outlines is acted on only while nothing else says that the
// pixel must be much smaller, and a pixel so small that it can hardly blur anything is taken otherwise.
struct PixelSizeFinding {
  double size = 0;  // to act on; world units
  // Where less than `size`, a Gaussian gets the pixel that does no harm in its region, but no more than `size` and no
  // less than this: CautiousPixelSizes.
  double least = 0;
  // Gaussians among others that lie closer than this on the surface (GaussianRegions::SpacingOfMany) get the pixel that
  // does no harm there, too: they come of smaller ones. 0: there are none.
  double closer = 0;
  double largest = 0;  // that the outlines could mean: with and without black Gaussians
  // `size` if it were of Gaussians enough, where these lie so close that they do not make its outlines soft. 0: it is
  // of enough, they lie further apart, or more contradicts it.
  double of_more = 0;
  PixelSizeEstimate estimate;               // what the outlines say
  double small_axis = 0;                    // PixelSizeEvidence::small_axis
  double dense = 0;                         // PixelSizeEvidence::dense
  bool no_one_pixel = false;                // its Gaussians lie too unevenly for one
  bool balls = false;                       // its Gaussians are, and their sizes say nothing about pixels
  bool part = false;                        // cut out of something larger: a tenth of its outlines and more are cuts
  std::vector<std::string> contradictions;  // sentences that say what speaks against it; empty: nothing does

  bool contradicted() const { return !contradictions.empty(); }
  // The outlines say it within a factor that is wider than this: what learned from known pixels is not to act on it.
  static constexpr double kRough = 3;
  bool rough() const { return estimate.high > kRough * estimate.low; }
  // Of a thing of 20 pixels and of a table in ten pictures, whose estimates are half of the truth, outlines are at 2.1
  // and 2.5 (PixelSizeEstimate::strangeness).
  static constexpr double kTooStrange = 1.75;
  // Whether what the splat says of itself counts against cameras.
  bool sure() const {
    return !contradicted() && !part && !rough() && estimate.strangeness < kTooStrange && estimate.softness == 1;
  }
  bool is_one() const { return least >= size && closer == 0; }  // `size` is that of all Gaussians

  // How the estimate comes of what outlines say, in words, for a sentence about it; empty: it is what they say, or
  // nearly.
  std::string SoftnessInWords() const;
  std::string CutsInWords() const;  // likewise of outlines that do not count
};

// The numbers that an estimate is held against, of the Gaussians that show: opacity of 10 % or more, not nearly black.
// Fits on black keep black Gaussians around the object that no picture shows (where nothing else is there, all count).
struct PixelSizeEvidence {
  int64_t gaussians = 0;  // that show, near the middle of the cloud; no more than 200,000 of them
  int64_t all = 0;        // of any opacity and colour; 0: not counted
  double spacing = 0;     // side of the square that each has of the surface: from the distances to 8 neighbours
  double footprint = 0;   // √(largest × middle axis), median: where it is larger than the spacing they lie in layers
  double of_many = 0;     // the same from the distances to 512: median …
  double dense = 0;       // … the tenth part that lies closest …
  double closest = 0;     // … and least of 256 places
  double unevenness = 1;  // 90 % over 10 % quantile; infinite where 512 and more lie at one place
  double growth = 1;      // footprint where that spacing is of the largest tenth, over that of the least
  double small_axis = 0;  // of the smallest tenth by area: PixelSizeProbe::start
  double harmless = 0;    // pixel that does no harm in nine of ten regions: GaussianRegion::HarmlessPixel
  double flatness = 1, fill = 1, roundness = 0;  // CloudShape
  TwoSides sides = {};                           // of what is flat
  double without_black = 0;                      // the estimate without black Gaussians; 0: there are few of them
  double softness_without_black = 1;             // PixelSizeEstimate::softness of that
};
Result<PixelSizeEvidence> GatherPixelSizeEvidence(const GaussianCloud& cloud);
// What of it is of how Gaussians lie and what shape that has; ShowingGaussians::bright. All but the number is as it is
// without any where there are fewer than kLeastGaussians.
PixelSizeEvidence EvidenceOfSurface(const GaussianCloud& bright);

// Where the densest tenth of Gaussians lies as far apart as this, in pixels of a size, that size is not too large for
// them: a splat has few Gaussians where it has little detail. Those of 37 fits are at 0.5 to 3.2.
inline constexpr double kSparseEnough = 0.75;

// Gaussians beside each other on every pixel of the surface that fits keep at most: a cloud of `gaussians` that has
// more of them with a pixel size was fitted to smaller pixels. `showing`: PixelSizeEstimate::showing.
double MostGaussiansPerPixel(int64_t gaussians, double showing);

// Pixel sizes that do no harm to each region (GaussianRegion::HarmlessPixel), between `finding.least` and
// `finding.size`; where nothing contradicts that one, only of regions that are closer than `finding.closer`. One size
// for all would blur the fine ones of a splat that is mostly made of coarse ones, as of a subject before a sky. [N]
Buffer<float> CautiousPixelSizes(const GaussianCloud& cloud, const PixelSizeFinding& finding);

// What to make of an estimate in the light of the evidence.
PixelSizeFinding Judge(const PixelSizeEstimate& estimate, const PixelSizeEvidence& evidence);

// Whether the Gaussians lie as far apart as those of fits to pixels of that size, and too far for those that outlines
// say: leaves and twigs.
bool LiesAsFitsTo(double pixel, const PixelSizeFinding& finding);

// Whether they lie closer than in any fit to such pixels, and outlines say much smaller ones at most.
bool LiesTooCloseFor(double pixel, const PixelSizeFinding& finding);

// Whether a classic splat is sharper than a fit to pixels of that size could be. A rough estimate, one of strange
// outlines and one whose interval reaches them say nothing against them.
bool IsSharperThanFitsTo(double pixel, const PixelSizeFinding& finding);

// Scales with the cloud. Errors: those of EstimatePixelSize.
Result<PixelSizeFinding> FindPixelSize(const GaussianCloud& cloud);
// The same of what was found in a cloud; `mode`: its render mode.
Result<PixelSizeFinding> FindPixelSize(ShowingGaussians showing, std::optional<RenderMode> mode);

}  // namespace anchorsplat

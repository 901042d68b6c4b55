#include "enhance/network_choice.h"

#include <algorithm>
#include <string>

#include "core/log.h"
#include "core/text.h"
#include "enhance/cloud_shape.h"
#include "enhance/lost_width.h"
#include "enhance/showing_gaussians.h"

namespace anchorsplat {

namespace {

// Nearer than that the network takes something from what the filter has: 0.2 dB at 1.1, 0.3 at 1.2.
constexpr double kLeastUpscaleOfNetworks = 1.35;

void LeaveNetworksOut(MethodPlan& plan, const char* why) {
  const bool begins_with_network = plan.start != nullptr && plan.start->adds_detail;
  if (plan.chosen_by.empty() || !(plan.method->adds_detail || begins_with_network)) return;
  const std::string network = begins_with_network ? plan.start->name : plan.method->name;
  LogInfo(Cat("the filter instead of '", network, "', which ", why, " (--method ", network, " takes it all the same)"));
  if (plan.method->adds_detail) {
    plan.method = &*std::ranges::find(EnhanceMethods(), std::string("filter"), &EnhanceMethod::name);
  }
  if (begins_with_network) plan.start = nullptr;
}

// A network harms none whose kind is unclear at a pixel that is small enough: at 0.35 of theirs it gave 0.3 to 1.0 dB
// to most of twenty such splats and took 0.1 dB at most, where the filter gave 0.2 and took 0.2
// (docs/results/recognised.md, unclear).
constexpr double kPixelOfUnclear = 0.35;
// At a rough estimate, as after soft pictures, which may be half too large, it takes up to 0.7 dB from what the filter
// gives, and at 0.8 of it gives 0.3 dB more than the filter (docs/results/pixel-size.md, small-pixels).
constexpr double kPixelOfRough = 0.8;
// Rough ones that softness has hardly lowered are no larger than the truth: a crate and a bank at 0.79 and 0.91, MCMC
// of two rests (0.4 to 1). They are taken whole.
constexpr double kHardlyLowered = 0.9;
// PixelSizeEstimate::softness of fits whose pictures were all soft: 0.37 to 0.59; where a part of them is, 0.62 and
// 0.64, and these lose 0.6 to 1.0 dB by that.
constexpr double kSoft = 0.6;
// Gaussians that are nearly balls, 0.62 and more, were made of points and fitted to no pixels; those of fits are at 0.4
// at most (CloudShape::roundness).
constexpr double kRound = 0.5;

bool IsOfSoftPictures(double softness) { return softness < kSoft; }

bool MayBeTooLarge(const PixelSizeFinding& finding) {
  return finding.rough() && finding.estimate.softness < kHardlyLowered;
}

bool IsOfAFit(const GaussianCloud& showing, int64_t all) {
  return all >= kFewGaussians && ShapeOf(showing).roundness < kRound;
}

bool BearsSmallPixels(const MethodPlan& plan, const EnhanceInput& input) {
  return plan.start == nullptr && IsOfAFit(FindShowingGaussians(input.cloud).all, input.cloud.size());
}

void TakeSmallerPixels(double share, const char* why, EnhanceInput& input, EnhanceReport& report) {
  for (float& size : input.pixel_sizes) size *= static_cast<float>(share);
  input.pixel_size = report.pixel_size *= share;
  report.pixel_size_source = kCautiousPixelSize;
  LogInfo(Cat("as ", why, ", the network takes pixels of ", share, " of their size, ", report.pixel_size));
}

}  // namespace

bool TakesSureOnly(const MethodPlan& plan, const EnhanceInput& input) {
  return !input.sure.empty() && !plan.chosen_by.empty() && plan.start == nullptr && plan.method->adds_detail;
}

double ShareForNetwork(std::optional<TrainedKind> looks, const GaussianCloud& showing, int64_t all,
                       const PixelSizeFinding& finding) {
  if (finding.contradicted()) return 1;
  if (looks == TrainedKind::kUnclear) return IsOfAFit(showing, all) ? kPixelOfUnclear : 1;
  if (looks == TrainedKind::kRaised || IsWide(looks)) return 1;
  return MayBeTooLarge(finding) || IsOfSoftPictures(finding.estimate.softness) ? kPixelOfRough : 1;
}

void ChooseNetwork(const EnhanceOptions& options, bool unknown_of_few, MethodPlan& plan, EnhanceInput& input,
                   EnhanceReport& report) {
  const bool unclear = report.looks == TrainedKind::kUnclear, raised = report.looks == TrainedKind::kRaised;
  const bool whole = report.pixel_size_source != kCautiousPixelSize || TakesSureOnly(plan, input);
  const bool one = whole && report.things.empty();
  const bool rough = one && report.finding && report.finding->rough();
  const bool large = rough && MayBeTooLarge(*report.finding);
  const bool soft = one && IsOfSoftPictures(input.softness);
  // Of captures of which neither kind nor pixel is known networks make spots and haze that pictures do not have.
  const bool doubtful = report.finding && report.finding->contradicted();
  const bool network_alone = !plan.chosen_by.empty() && plan.start == nullptr && plan.method->adds_detail;
  if (report.finding && report.finding->balls) {
    LeaveNetworksOut(plan, "has learned from Gaussians that are no balls");
  } else if (options.upscale < kLeastUpscaleOfNetworks) {
    LeaveNetworksOut(plan, "has learned what is missing 2 to 8 times closer");
  } else if (unknown_of_few || raised || (unclear && (doubtful || !BearsSmallPixels(plan, input)))) {
    LeaveNetworksOut(plan, "has learned what splats of known kinds have lost");
  } else if (unclear && whole && network_alone) {
    TakeSmallerPixels(kPixelOfUnclear, "it is not clear what the splat has lost", input, report);
  } else if ((large || soft) && network_alone) {
    TakeSmallerPixels(kPixelOfRough, large ? "that is rough" : "it seems to be of soft pictures", input, report);
  } else if (rough && !network_alone) {
    LeaveNetworksOut(plan, "measures Gaussians in pixels, of which this splat says little");
  }
}

}  // namespace anchorsplat

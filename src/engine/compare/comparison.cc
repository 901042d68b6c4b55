#include "compare/comparison.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "cameras/view_labels.h"
#include "core/log.h"
#include "core/text.h"
#include "metrics/color_correction.h"
#include "metrics/compare.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

Result<std::vector<std::vector<size_t>>> MatchSources(std::span<ViewSource* const> sources,
                                                      const ViewSource& reference) {
  std::vector<std::vector<size_t>> out;
  for (const ViewSource* source : sources) {
    if (source->names().size() == 1 && reference.names().size() == 1 && source->is_pictures() &&
        reference.is_pictures()) {
      out.push_back({0});
      continue;
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewPairs matched, MatchViews(source->names(), reference.names()));
    std::vector<size_t>& partner = out.emplace_back(reference.names().size(), kNoView);
    for (const ViewPair& pair : matched.pairs) partner[pair.b] = pair.a;
  }
  return out;
}

namespace {

bool IsWhole(const std::vector<std::vector<size_t>>& partners, size_t view) {
  return std::ranges::none_of(partners, [view](const auto& partner) { return partner[view] == kNoView; });
}

// Logs views missing on some side. kBadArgument if no view is on all sides.
Status TellOfMissing(std::span<ViewSource* const> sources, const std::vector<std::vector<size_t>>& partners,
                     const ViewSource& reference) {
  std::vector<std::string> missing, spare;  // of the reference's views, and of the sources'
  const std::vector<std::string> labels = ViewLabels(reference.names());
  for (size_t r = 0; r < labels.size(); ++r) {
    if (!IsWhole(partners, r)) missing.push_back(labels[r]);
  }
  for (size_t s = 0; s < sources.size(); ++s) {
    const std::vector<std::string> own = ViewLabels(sources[s]->names());
    for (size_t i = 0; i < own.size(); ++i) {
      if (std::ranges::find(partners[s], i) != partners[s].end()) continue;
      if (std::ranges::find(spare, own[i]) == spare.end()) spare.push_back(own[i]);
    }
  }
  if (missing.empty() && spare.empty()) return {};
  std::string sentence;
  if (!missing.empty()) sentence += Cat("only in the reference ", FirstFew(missing));
  if (!spare.empty()) sentence += Cat(missing.empty() ? "" : "; ", "not in the reference ", FirstFew(spare));
  if (missing.size() == labels.size()) {
    return Error{ErrorCode::kBadArgument, Cat("no view is on both sides: ", sentence)};
  }
  const size_t count = missing.size() + spare.size();
  LogWarning(Cat(count, count == 1 ? " view has no counterpart and is" : " views have no counterpart and are",
                 " skipped: ", sentence));
  return {};
}

// Reports all views with different picture sizes before rendering any.
Status CheckSizes(std::span<ViewSource* const> sources, const std::vector<std::vector<size_t>>& partners,
                  const ViewSource& reference) {
  constexpr int kShown = 10;
  std::string list;
  int different = 0;
  const std::vector<std::string> labels = ViewLabels(reference.names());
  for (size_t r = 0; r < reference.names().size(); ++r) {
    if (!IsWhole(partners, r)) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ImageSize truth, reference.SizeOf(r));
    std::vector<std::string> others;  // distinct sizes
    for (size_t s = 0; s < sources.size(); ++s) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const ImageSize size, sources[s]->SizeOf(partners[s][r]));
      if (size.width == truth.width && size.height == truth.height) continue;
      std::string text = Cat(size.width, "x", size.height);
      if (std::ranges::find(others, text) == others.end()) others.push_back(std::move(text));
    }
    if (others.empty() || ++different > kShown) continue;
    list += Cat(list.empty() ? "" : ", ", labels[r], " (");
    for (size_t k = 0; k < others.size(); ++k) list += Cat(k == 0 ? "" : ", ", others[k]);
    list += Cat(" and ", truth.width, "x", truth.height, ")");
  }
  if (different == 0) return {};
  if (different > kShown) list += Cat(" and ", different - kShown, " more");
  return Error{ErrorCode::kBadArgument, Cat("pictures of different sizes: ", list, "; --size sets that of renders")};
}

// Union of both masks.
Buffer<uint8_t> EitherIgnored(const Buffer<uint8_t>& a, const Buffer<uint8_t>& b) {
  if (a.size() != b.size()) return a.empty() ? b : a;  // one picture has no mask
  Buffer<uint8_t> either = a;
  for (size_t i = 0; i < either.size(); ++i) either[i] = a[i] != 0 || b[i] != 0;
  return either;
}

Result<CorrectedScore> CorrectColors(Image image, const Image& truth, const Buffer<uint8_t>& ignored,
                                     const CompareOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ColorMap map, FitColors(image, truth));
  ApplyColors(map, image);
  FillIgnored(ignored, truth, image);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const MaskedQuality quality, MeasureMasked(image, truth, ignored));
  CorrectedScore score{quality.psnr, quality.ssim, std::nullopt};
  if (options.lpips) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(score.lpips, options.lpips(image, truth));
  }
  return score;
}

// Scores a view; unset if fully masked.
Result<std::optional<ViewScore>> Score(Image image, const Image& truth, const Buffer<uint8_t>& ignored,
                                       const CompareOptions& options) {
  FillIgnored(ignored, truth, image);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const MaskedQuality quality, MeasureMasked(image, truth, ignored));
  if (quality.counted == 0) return std::optional<ViewScore>();
  ViewScore score;
  score.psnr = quality.psnr;
  score.ssim = quality.ssim;
  if (options.lpips) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(score.lpips, options.lpips(image, truth));
  }
  if (options.color_correct) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(score.corrected, CorrectColors(std::move(image), truth, ignored, options));
  }
  return std::optional<ViewScore>(std::move(score));
}

void TakeMeans(const CompareOptions& options, Comparison& comparison) {
  const auto n = static_cast<double>(comparison.views.size());
  if (options.lpips) comparison.mean_lpips = 0;
  if (options.color_correct) comparison.mean_corrected = CorrectedScore{0, 0, comparison.mean_lpips};
  for (const ViewScore& view : comparison.views) {
    if (view.lpips) *comparison.mean_lpips += *view.lpips / n;
    comparison.mean_psnr += view.psnr / n;
    comparison.mean_ssim += view.ssim / n;
    if (!view.corrected) continue;
    CorrectedScore& mean = *comparison.mean_corrected;
    mean.psnr += view.corrected->psnr / n;
    mean.ssim += view.corrected->ssim / n;
    if (view.corrected->lpips) *mean.lpips += *view.corrected->lpips / n;
  }
}

}  // namespace

Result<std::vector<Comparison>> CompareToReference(std::span<ViewSource* const> sources, ViewSource& reference,
                                                   const CompareOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto partners, MatchSources(sources, reference));
  ANCHORSPLAT_RETURN_IF_ERROR(TellOfMissing(sources, partners, reference));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckSizes(sources, partners, reference));
  const std::vector<std::string> labels = ViewLabels(reference.names());
  std::vector<Comparison> out(sources.size());
  Progress progress("compare", static_cast<int64_t>(reference.names().size()));
  std::vector<std::string> masked;
  int64_t count = 0;
  for (size_t r = 0; r < reference.names().size(); ++r) {
    const std::string& name = labels[r];
    if (!IsWhole(partners, r)) {
      progress.Advance();
      continue;
    }
    ++count;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image truth, reference.Load(r));
    std::vector<ViewScore> scores;  // one per source
    for (size_t s = 0; s < sources.size(); ++s) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, sources[s]->Load(partners[s][r]));
      const Buffer<uint8_t> ignored = EitherIgnored(reference.ignored(), sources[s]->ignored());
      ANCHORSPLAT_ASSIGN_OR_RETURN(std::optional<ViewScore> score, Score(std::move(image), truth, ignored, options));
      if (!score) break;
      score->name = name;
      score->reference_view = r;
      scores.push_back(*std::move(score));
    }
    progress.Advance();
    if (scores.size() < sources.size()) {  // skipped for all sources, so that means are comparable
      masked.push_back(name);
      continue;
    }
    for (size_t s = 0; s < sources.size(); ++s) out[s].views.push_back(std::move(scores[s]));
  }
  if (!masked.empty() && std::ssize(masked) == count) {
    return Error{ErrorCode::kBadArgument,
                 "the masks hide every pixel of all views: black hides a pixel, white uses it"};
  }
  if (!masked.empty()) LogWarning(WhollyMasked(masked, count));
  for (Comparison& comparison : out) TakeMeans(options, comparison);
  return out;
}

}  // namespace anchorsplat

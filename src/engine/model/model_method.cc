#include "model/model_method.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "compact/compact_checkpoint.h"
#include "compact/copy_choice.h"
#include "compact/shipped_network.h"
#include "core/activations.h"
#include "core/log.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "enhance/enhance_region.h"
#include "enhance/filter.h"
#include "enhance/gaussian_budget.h"
#include "enhance/unseen_gaussians.h"
#include "io/file_version.h"
#include "kernels/bfloat16_tile.h"
#include "model/any_network.h"
#include "model/network_options.h"

namespace anchorsplat {

namespace {

// Shares from which the log mentions Gaussians unlike training, and warns.
constexpr double kNotable = 0.01, kMost = 0.5;

// Compact networks build on the filter; the published one does not.
std::vector<MethodOption> OptionsOfNetworks() {
  std::vector<MethodOption> options = WidthOptions([](const MethodUse& use) {
    return IsPublished(use.options.model) ? "with a compact network, --method filter or refine" : "";
  });
  options.push_back(BudgetOption());
  for (const char* name : {"checkpoint", "resume"}) {
    options.push_back({.name = name, .lacks = [](const MethodUse& use) {
                         return IsPublished(use.options.model) ? "with a compact network" : "";
                       }});
  }
  for (const auto& more : {NetworkOptions(), PublishedScriptOptions()}) {
    options.insert(options.end(), more.begin(), more.end());
  }
  return options;
}

Result<GaussianCloud> EnhanceWithPublished(EnhanceInput input, const PublishedNetwork& network,
                                           const PublishedOptions& options, StepReport& report) {
  KeepOnlyRegion(input);
  ANCHORSPLAT_ASSIGN_OR_RETURN(PublishedResult result, EnhanceWithPublishedNetwork(input.cloud, network, options));
  const PublishedReport& r = result.report;
  report.dropped += r.not_finite + r.outside;
  report.facts = {{"over_limit", r.over_limit},
                  {"anchors", r.anchors},
                  {"output_not_finite", r.output_not_finite},
                  {"pruned", r.pruned},
                  {"blocks", r.blocks}};
  return std::move(result.cloud);
}

// bfloat16 only serves speed: without dot products for it, a processor is slower and less exact with it.
WeightPrecision FastPrecision(WeightPrecision asked) {
  if (asked != WeightPrecision::kBFloat16 || UsesBFloat16Dot()) return asked;
  LogWarning("using fp32: bf16 would be slower, as this processor has no bfloat16 products");
  return WeightPrecision::kFloat;
}

Result<AnyNetwork> Load(const ModelSettings& model, Shipped shipped) {
  if (!model.file.empty()) return LoadAnyNetwork(model.file, FastPrecision(model.precision));
  ANCHORSPLAT_ASSIGN_OR_RETURN(CompactNetwork network, LoadShippedNetwork(shipped));
  return AnyNetwork(std::move(network));
}

// Caches the last network for all calls that ask for it, concurrent ones included. A network in use stays alive. A
// changed file counts as another network.
class LastNetwork {
 public:
  // `shipped`: used if no file is named.
  Result<std::shared_ptr<const AnyNetwork>> Get(const ModelSettings& model, Shipped shipped = Shipped::kClassic) {
    const std::lock_guard lock(mutex_);
    // Taken before reading, so that a change meanwhile is noticed by the next call.
    const std::optional<FileVersion> version = VersionOf(model.file);
    if (network_ == nullptr || file_ != model.file || shipped_ != shipped || version_ != version ||
        precision_ != model.precision) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(AnyNetwork network, Load(model, shipped));
      network_ = std::make_shared<const AnyNetwork>(std::move(network));
      file_ = model.file;
      shipped_ = shipped;
      version_ = version;
      precision_ = model.precision;
    }
    return network_;
  }

 private:
  std::mutex mutex_;
  std::filesystem::path file_;
  Shipped shipped_ = Shipped::kClassic;
  std::optional<FileVersion> version_;
  WeightPrecision precision_ = WeightPrecision::kFloat;
  std::shared_ptr<const AnyNetwork> network_;
};

Shipped ShippedFor(const EnhanceInput& input, const ModelSettings& model) {
  if (IsCompensated(input.cloud.render_mode)) return Shipped::kAntialiased;
  // 0.6 dB better than merging four copies into one, over fifteen fits (docs/benchmarks.md#one-for-one).
  return model.copies == 1 ? Shipped::kSingle : Shipped::kClassic;
}

bool WantsStandIns(Shipped shipped, const EnhanceInput& input, const ModelSettings& model) {
  return model.file.empty() && shipped == Shipped::kClassic && !model.copies && !input.is_refined;
}

}  // namespace

Result<GaussianCloud> EnhanceWithCompactNetwork(EnhanceInput input, double upscale, const CompactNetwork& network,
                                                const ModelSettings& model, StepReport& report,
                                                const RefineControl& control, const CompactNetwork* stand_in) {
  // How many copies of each Gaussian stay.
  const CopyChoice choice = {model.copies, model.merge_cost.value_or(input.is_refined ? kMergeCostOfStart : kMergeCost),
                             model.options.max_gaussians, model.options.prune_opacity};
  const auto within_budget = [&]() -> Result<GaussianCloud> {
    ANCHORSPLAT_RETURN_IF_ERROR(Validate(CopyChoice{.max_gaussians = choice.max_gaussians}, 1));
    KeepOnlyRegion(input);
    report.facts = {{"copies", int64_t{1}}};
    const int64_t left_out = DropLeastVisible(model.options.max_gaussians, input.cloud);
    if (left_out > 0) report.facts.emplace_back("left_out", left_out);
    return std::move(input.cloud);
  };
  // The splat has no lost width to restore.
  if (input.filter_strength <= ShownStrength(upscale, input.cloud.render_mode)) return within_budget();
  if (IsCompensated(input.cloud.render_mode) && !network.config().knows_kind) {
    LogInfo(Cat("filtering only: the network was trained on classic splats, and this is ",
                NameOf(*input.cloud.render_mode)));
    const auto grown =
        ApplyFilter(input.cloud, input.pixel_sizes, {.upscale = upscale, .strength = input.filter_strength});
    if (!grown.ok()) return grown.error();
    return within_budget();
  }
  const int64_t count = input.in_region.empty() ? input.cloud.size() : std::ranges::count(input.in_region, 1);
  const auto n = static_cast<double>(count);
  // Specks get no copies, unless a number of copies was requested.
  std::vector<int64_t> dust;
  const Stopwatch watch;
  if (!model.copies) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(dust, PredictUnseen(input.cloud));
  }
  const double seconds_unseen = watch.Total();
  ANCHORSPLAT_ASSIGN_OR_RETURN(CompactResult result,
                               network.Apply(std::move(input.cloud), {.pixel_sizes = input.pixel_sizes,
                                                                      .upscale = upscale,
                                                                      .strength = input.filter_strength,
                                                                      .choice = choice,
                                                                      .single = dust,
                                                                      .stand_in = stand_in,
                                                                      .in_region = input.in_region,
                                                                      .checkpoint = control.checkpoint,
                                                                      .resume = control.resume}));
  const auto unlike = static_cast<double>(result.unlike_training),
             partly_unlike = static_cast<double>(result.partly_unlike_training);
  if (unlike + partly_unlike > kNotable * n) {
    const auto [least, greatest] = network.TrainedUpscales();
    const bool other_upscale = least <= greatest && (upscale < 0.99 * least || upscale > 1.01 * greatest);
    const std::string text = Cat(
        Fixed(100 * (unlike + partly_unlike) / n, 1),
        " % of the Gaussians are unlike the network's training data: ", Fixed(100 * unlike / n, 1),
        " % are filtered only, ", Fixed(100 * partly_unlike / n, 1), " % partly enhanced",
        other_upscale ? Cat(". It was trained for --upscale ", Fixed(std::sqrt(least * greatest), 1), ", not ", upscale)
                      : "");
    unlike + partly_unlike > kMost* n ? LogWarning(text) : LogInfo(text);
  }
  if (result.not_finite > 0 && result.not_finite == count - result.unlike_training) {
    return Error{ErrorCode::kBadFile,
                 "the network returned NaN or infinite values for every Gaussian: its weights are damaged"};
  }
  if (result.not_finite > 0) {
    LogWarning(Cat("the network returned NaN or infinite values for ", WithThousands(result.not_finite),
                   " Gaussians, which are filtered only. Its weights may be damaged"));
  }
  const int64_t before = result.cloud.size();
  if (choice.invisible > 0) {
    std::vector<char> keep(static_cast<size_t>(before));
    for (size_t i = 0; i < keep.size(); ++i) {
      keep[i] = Sigmoid(result.cloud.opacity_logits[i]) >= choice.invisible ? 1 : 0;
    }
    KeepMarked(keep, result.cloud);
  }
  report.facts = {{"copies", network.config().copies},
                  {"unlike_training", result.unlike_training},
                  {"partly_unlike_training", result.partly_unlike_training},
                  {"output_not_finite", result.not_finite},
                  {"blocks_resumed", result.resumed},
                  {"copies_made", result.made},
                  {"merged", result.chosen.merged},
                  {"unseen", std::ssize(dust)},
                  {"pruned", before - result.cloud.size()},
                  {"left_out", result.chosen.left_out},
                  {"seconds_unseen", seconds_unseen},
                  {"seconds_neighbours", result.times.neighbours},
                  {"seconds_network", result.times.network},
                  {"seconds_copies", result.times.copies},
                  {"seconds_order", result.times.order}};
  return std::move(result.cloud);
}

EnhanceMethod ModelMethod() {
  const auto last = std::make_shared<LastNetwork>(), last_stand_in = std::make_shared<LastNetwork>();
  return {
      .name = "model",
      .summary = HasShippedNetwork() ? "one pass of the network (built in, or --model FILE)"
                                     : "one pass of the network --model FILE",
      .rank = 1,
      .adds_detail = true,
      .is_checkpoint = IsCompactCheckpoint,
      .checkpoints_on_request = true,
      .options = OptionsOfNetworks(),
      .needs_pixel_size = [](const EnhanceOptions& options) -> Result<bool> {
        if (options.model.file.empty()) return true;
        return HoldsCompactNetwork(options.model.file);
      },
      .expected_gaussians = [last](int64_t count, const EnhanceOptions& options) -> int64_t {
        const auto network = last->Get(options.model);
        if (!network.ok()) return count;  // which the run will say
        if (const auto* published = std::get_if<PublishedNetwork>(network->get())) {
          const int64_t most = options.model.options.max_gaussians;
          return published->config().copies * (most > 0 ? std::min(count, most) : count);
        }
        const int64_t copies = std::get<CompactNetwork>(**network).config().copies;
        const int64_t all = count * std::clamp<int64_t>(options.model.copies.value_or(copies), 1, copies);
        const int64_t most = options.model.options.max_gaussians;
        return most > 0 ? std::min(all, most) : all;
      },
      .seconds_per_gaussian = [](const EnhanceOptions& options) { return IsPublished(options.model) ? 2e-4 : 2.5e-5; },
      .ready = [](const EnhanceOptions& options) -> Status {
        if (!options.model.file.empty() || HasShippedNetwork()) return {};
        return Error{ErrorCode::kBadArgument, "the method 'model' needs weights: --model FILE"};
      },
      .run = [last, last_stand_in](EnhanceInput input, const EnhanceOptions& options,
                                   StepReport& report) -> Result<GaussianCloud> {
        const Shipped shipped = ShippedFor(input, options.model);
        ANCHORSPLAT_ASSIGN_OR_RETURN(const std::shared_ptr<const AnyNetwork> network,
                                     last->Get(options.model, shipped));
        if (const auto* published = std::get_if<PublishedNetwork>(network.get())) {
          return EnhanceWithPublished(std::move(input), *published, options.model.options, report);
        }
        std::shared_ptr<const AnyNetwork> stand_in;
        if (WantsStandIns(shipped, input, options.model)) {
          ANCHORSPLAT_ASSIGN_OR_RETURN(stand_in, last_stand_in->Get(options.model, Shipped::kSingle));
        }
        return EnhanceWithCompactNetwork(std::move(input), options.upscale, std::get<CompactNetwork>(*network),
                                         options.model, report, options.control,
                                         stand_in ? std::get_if<CompactNetwork>(stand_in.get()) : nullptr);
      }};
}

const std::vector<EnhanceMethod>& AllMethods() {
  static const std::vector<EnhanceMethod> methods = [] {
    std::vector<EnhanceMethod> all = BasicMethods();
    all.push_back(ModelMethod());
    return all;
  }();
  return methods;
}

}  // namespace anchorsplat

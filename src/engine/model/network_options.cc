#include "model/network_options.h"

#include <charconv>
#include <tuple>

#include "core/text.h"
#include "model/any_network.h"

namespace anchorsplat {

namespace {

// Whether it is certainly a compact network; unreadable files are reported on loading.
bool IsCompact(const ModelSettings& model) {
  if (model.file.empty()) return true;  // built into the program
  const auto compact = HoldsCompactNetwork(model.file);
  return compact.ok() && *compact;
}

std::string WithCompact(const MethodUse& use) { return IsPublished(use.options.model) ? "with a compact network" : ""; }
std::string WithPublished(const MethodUse& use) {
  return IsCompact(use.options.model) ? "with a network of the published architecture (--model FILE)" : "";
}

template <auto Member>
OptionValue InSettings(EnhanceOptions& options) {
  return &(options.model.*Member);
}
template <auto Member>
OptionValue InPublished(EnhanceOptions& options) {
  return &(options.model.options.*Member);
}
template <auto Member, class Enum>
auto Choice(std::initializer_list<std::pair<std::string, Enum>> choices) {
  return [choices = std::vector(choices)](EnhanceOptions& options) -> OptionValue {
    return ChoiceOf(options.model.options.*Member, choices);
  };
}
// What `parse` makes of a word.
template <class Value>
OptionValue Parsed(Value& value, const char* now, Result<Value> (*parse)(const std::string&)) {
  return WordOption{.now = now, .set = [&value, parse](const std::string& text) -> Status {
                      ANCHORSPLAT_ASSIGN_OR_RETURN(value, parse(text));
                      return {};
                    }};
}

// "identity", the seed of PyTorch's generator, or five permutations such as 1230,0321,1023,3102,0321.
Result<Shuffles> ParseShuffles(const std::string& text) {
  if (text == "identity") return kNoShuffles;
  Shuffles shuffles;
  constexpr size_t kWidth = std::tuple_size_v<Shuffle> + 1;  // digits and a comma
  if (text.size() + 1 == kWidth * shuffles.size()) {
    bool well_formed = true;
    for (size_t i = 0; i < text.size(); ++i) {
      const bool comma = i % kWidth == kWidth - 1;
      well_formed &= comma ? text[i] == ',' : text[i] >= '0' && text[i] <= '9';
      if (!comma) shuffles[i / kWidth][i % kWidth] = static_cast<uint8_t>(text[i] - '0');
    }
    if (well_formed && Validate(shuffles).ok()) return shuffles;
  }
  uint64_t seed = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (code == std::errc() && end == text.data() + text.size()) return ShufflesFromSeed(seed);
  return Error{ErrorCode::kBadArgument,
               Cat("'", Printable(text),
                   "' is neither 'identity', nor a seed, nor five permutations such as 1230,0321,1023,3102,0321")};
}

// A whole number of at least 1; unset for "auto".
Result<std::optional<int64_t>> ParseCopies(const std::string& text) {
  if (text == "auto") return std::optional<int64_t>();
  int64_t number = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (code == std::errc() && end == text.data() + text.size() && number >= 1 && number <= 64)
    return std::optional(number);
  return Error{ErrorCode::kBadArgument, Cat("'", Printable(text), "' is neither 'auto' nor 1, 2, 3, …")};
}

}  // namespace

bool IsPublished(const ModelSettings& model) {
  if (model.file.empty()) return false;
  const auto compact = HoldsCompactNetwork(model.file);
  return compact.ok() && !*compact;
}

const std::vector<MethodOption>& NetworkOptions() {
  static const std::vector<MethodOption> options = {
      {"model", InSettings<&ModelSettings::file>, "Weights of a compact or AnchorSplat network, .safetensors or .pth"},
      {"copies",
       [](EnhanceOptions& o) { return Parsed(o.model.copies, "auto", ParseCopies); },
       "Most Gaussians that a compact network makes of each; auto: fewer where the difference is invisible",
       {},
       WithCompact,
       "N"},
      {"merge-cost", InSettings<&ModelSettings::merge_cost>,
       "With --copies auto: most error per merged Gaussian, in closer-view pixels x squared difference (default: "
       "0.0003)",
       kZeroOrMore,
       [](const MethodUse& use) {
         const std::string lack = WithCompact(use);
         return lack.empty() && use.options.model.copies ? "with --copies auto" : lack;
       }},
      {"prune-opacity", InPublished<&PublishedOptions::prune_opacity>,
       "Drop network output fainter than this; 1/255 = 0.0039 is invisible", kZeroToOne},
      {"block-gaussians",
       InPublished<&PublishedOptions::block_gaussians>,
       "Enhance larger splats in overlapping blocks of this size",
       {1000, 100'000'000},
       [](const MethodUse& use) {
         return use.options.model.options.upstream ? "without --compat upstream" : WithPublished(use);
       }},
      {"precision",
       [](EnhanceOptions& o) -> OptionValue {
         return ChoiceOf<WeightPrecision>(o.model.precision,
                                          {{"fp32", WeightPrecision::kFloat}, {"bf16", WeightPrecision::kBFloat16}});
       },
       "Of matrix products, convolutions and attention; bf16 needs processor support (`doctor` reports it)",
       {},
       WithPublished},
  };
  return options;
}

const std::vector<MethodOption>& PublishedScriptOptions() {
  static const std::vector<MethodOption> options = {
      {"compat",
       Choice<&PublishedOptions::upstream, bool>({{"upstream", true}}),
       "upstream: repeat the published script, quirks included; its fp16 attention is --attention-rounding fp16",
       {},
       WithPublished},
      {"normalisation",
       Choice<&PublishedOptions::normalisation, NormalisationMode>({{"auto", NormalisationMode::kAuto},
                                                                    {"centered", NormalisationMode::kCentered},
                                                                    {"bbox", NormalisationMode::kBbox},
                                                                    {"unit", NormalisationMode::kUnit}}),
       "How to fit the splat into the network's unit cube",
       {},
       WithPublished},
      {"attention-rounding",
       Choice<&PublishedOptions::rounding, Rounding>(
           {{"none", Rounding::kNone}, {"fp16", Rounding::kHalf}, {"bf16", Rounding::kBFloat16}}),
       "Rounding of queries, keys, values and probabilities; the release uses fp16",
       {},
       [](const MethodUse& use) {
         const ModelSettings& model = use.options.model;
         const bool none = model.options.rounding == Rounding::kNone;
         return none && model.precision == WeightPrecision::kBFloat16 ? "without --precision bf16" : WithPublished(use);
       }},
      {"curve-depth",
       Choice<&PublishedOptions::depth_rule, DepthRule>(
           {{"v1.5", DepthRule::kLargest}, {"v1.6", DepthRule::kLargestPlusOne}}),
       "Bits of the space-filling curves, by Pointcept release",
       {},
       WithPublished},
      {"shuffles",
       [](EnhanceOptions& o) { return Parsed(o.model.options.shuffles, "identity", ParseShuffles); },
       "Order of the space-filling curves: identity, a PyTorch seed, or five permutations",
       {},
       WithPublished,
       "ORDER"},
  };
  return options;
}

}  // namespace anchorsplat

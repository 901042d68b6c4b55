#include <algorithm>
#include <utility>

#include "core/text.h"
#include "enhance/enhance.h"
#include "enhance/refine_method.h"

namespace anchorsplat {

namespace {

// The best ready instant method; the filter is always ready.
const EnhanceMethod* BestInstant(const EnhanceOptions& options) {
  const EnhanceMethod* best = nullptr;
  for (const EnhanceMethod& method : MethodsOf(options)) {
    if (method.takes_start || !method.ready(options).ok()) continue;
    if (best == nullptr || method.rank > best->rank) best = &method;
  }
  return best;
}

// A start that refinement can use: one that adds detail. Mere width it restores itself.
const EnhanceMethod* StartWithDetail(const EnhanceOptions& options) {
  const EnhanceMethod* best = BestInstant(options);
  return best->adds_detail ? best : nullptr;
}

Result<const EnhanceMethod*> FindMethod(const EnhanceOptions& options, const std::string& name) {
  const EnhanceMethod* best = nullptr;
  std::string names;
  for (const EnhanceMethod& method : MethodsOf(options)) {
    names += ", " + method.name;
    if (method.name == name) {
      ANCHORSPLAT_RETURN_IF_ERROR(method.ready(options));
      return &method;
    }
    if ((best == nullptr || method.rank > best->rank) && method.ready(options).ok()) best = &method;
  }
  if (name == "auto") return best;
  return Error{ErrorCode::kBadArgument, Cat("unknown method '", Printable(name), "' (known: auto", names, ")")};
}

Result<MethodPlan> PlanQuality(const EnhanceOptions& options) {
  const std::string& quality = options.quality;
  if (quality != "fast" && quality != "good" && quality != "best") {
    return Error{ErrorCode::kBadArgument, Cat("unknown quality '", Printable(quality), "' (known: fast, good, best)")};
  }
  const bool pictures = !options.refine.images.empty();
  if (pictures && quality != "best") {
    return Error{ErrorCode::kBadArgument,
                 Cat("--images has no effect with --quality ", quality, "; it works only with --quality best")};
  }
  MethodPlan plan;
  plan.chosen_by = "--quality " + quality;
  if (quality == "fast") {
    plan.method = BestInstant(options);
  } else {
    plan.start = StartWithDetail(options);
    const bool enlarges = quality == "best" && CanEnlarge(options.upscale);
    ANCHORSPLAT_ASSIGN_OR_RETURN(plan.method, FindMethod(options, pictures   ? "refine-images"
                                                                  : enlarges ? "detail"
                                                                             : "refine"));
  }
  if (options.method != "auto" && options.method != plan.Name()) {
    return Error{ErrorCode::kBadArgument, Cat(plan.chosen_by, " is --method ", plan.Name(),
                                              ", so it excludes --method ", Printable(options.method))};
  }
  return plan;
}

const MethodOption* FindOption(const EnhanceMethod* method, const std::string& name) {
  if (method == nullptr) return nullptr;
  const auto named = [&](const MethodOption& option) { return option.name == name; };
  const auto found = std::find_if(method->options.begin(), method->options.end(), named);
  return found == method->options.end() ? nullptr : &*found;
}

}  // namespace

bool IsGiven(const EnhanceOptions& options, std::string_view name) {
  return std::ranges::find(options.given, name) != options.given.end();
}

std::vector<MethodOption> WidthOptions(const std::function<std::string(const MethodUse&)>& lacks) {
  std::vector<MethodOption> options;
  for (const char* name : {"upscale", "pixel-size", "cameras", "train-width", "camera-rule", "filter-strength"}) {
    options.push_back({.name = name, .lacks = lacks});
  }
  return options;
}

MethodOption BudgetOption() {
  return {"max-gaussians", [](EnhanceOptions& options) -> OptionValue { return &options.max_gaussians; }, "",
          kZeroOrMore};
}

std::string MethodPlan::Name() const { return start == nullptr ? method->name : Cat(start->name, "+", method->name); }

bool MethodPlan::KeepsCheckpoint(const EnhanceOptions& options) const {
  if (method->is_checkpoint == nullptr || options.refine.seconds) return false;
  return !method->checkpoints_on_request || options.control.resume || !options.control.checkpoint.empty();
}

Result<MethodPlan> PlanEnhancement(const EnhanceOptions& options) {
  if (!options.quality.empty()) return PlanQuality(options);
  MethodPlan plan;
  const size_t plus = options.method.find('+');
  if (plus == std::string::npos) {
    if (options.method == "auto") plan.chosen_by = "auto";
    ANCHORSPLAT_ASSIGN_OR_RETURN(plan.method, FindMethod(options, options.method));
    if (plan.method->starts_from_best(options)) plan.start = StartWithDetail(options);
    return plan;
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(plan.start, FindMethod(options, options.method.substr(0, plus)));
  ANCHORSPLAT_ASSIGN_OR_RETURN(plan.method, FindMethod(options, options.method.substr(plus + 1)));
  if (!plan.method->takes_start) {
    return Error{ErrorCode::kBadArgument, Cat("the method '", plan.method->name, "' cannot follow another method")};
  }
  return plan;
}

Status CheckOptions(const EnhanceOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const MethodPlan plan, PlanEnhancement(options));
  for (const std::string& name : options.given) {
    std::string lack;
    bool works = options.clean && (name == "cameras" || name == "images" || name == "background");
    for (const auto& [method, start] : {std::pair(plan.method, plan.start), std::pair(plan.start, plan.start)}) {
      const MethodOption* option = FindOption(method, name);
      if (option == nullptr) continue;
      const MethodUse use{options, method == plan.method ? start : nullptr};
      const std::string lacking = option->lacks ? option->lacks(use) : "";
      works |= lacking.empty();
      if (lack.empty()) lack = lacking;
    }
    if (works) continue;
    if (lack.empty()) {
      std::vector<std::string> owners;
      for (const EnhanceMethod& method : MethodsOf(options)) {
        const bool listed = std::find(owners.begin(), owners.end(), method.name) != owners.end();
        if (FindOption(&method, name) != nullptr && !listed) owners.push_back(method.name);
      }
      if (owners.empty()) continue;
      lack = "with --method " + OrList(owners) + (name == "background" ? ", and with --clean" : "");
    }
    return Error{ErrorCode::kBadArgument,
                 Cat("--", name, " has no effect with --method ", plan.Name(),
                     plan.chosen_by.empty() ? "" : Cat(" (chosen by ", plan.chosen_by, ")"), "; it works only ", lack)};
  }
  return {};
}

}  // namespace anchorsplat

#include "dataset/recipe.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <set>

#include "core/random.h"
#include "core/text.h"
#include "dataset/object_name.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMaxBytes = uint64_t{1} << 20;

// A value in the file, with error reporting.
struct Item {
  const std::string& file;
  std::string key;
  const toml::node& node;

  Error Complain(const std::string& sentence) const {
    return Error{ErrorCode::kBadFile, Cat(file, ": line ", node.source().begin.line, ": ", key, ": ", sentence)};
  }
  Result<double> Number() const {
    if (const auto value = node.value<double>(); value && node.is_number() && std::isfinite(*value)) return *value;
    return Complain("expected a number");
  }
  Result<int64_t> Whole(int64_t low, int64_t high) const {
    const auto value = node.value_exact<int64_t>();
    if (value && *value >= low && *value <= high) return *value;
    return Complain(Cat("expected a whole number from ", low, " to ", high));
  }
  Result<std::string> Text() const {
    if (const auto value = node.value_exact<std::string>()) return *value;
    return Complain("expected a string");
  }
  Result<bool> Flag() const {
    if (const auto value = node.value_exact<bool>()) return *value;
    return Complain("expected true or false");
  }
  Result<std::vector<double>> Numbers() const {
    const toml::array* array = node.as_array();
    if (array == nullptr) return Complain("expected an array of numbers");
    std::vector<double> out;
    for (const toml::node& element : *array) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double x, (Item{file, key, element}.Number()));
      out.push_back(x);
    }
    return out;
  }
};

using Take = Status (*)(const Item&, ObjectSettings&);

// Assigns an integer to `member`.
template <auto member>
Status TakeWhole(const Item& item, ObjectSettings& s) {
  auto& out = member(s);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t value, item.Whole(0, 1'000'000'000));
  out = static_cast<std::remove_reference_t<decltype(out)>>(value);
  return {};
}
template <auto member>
Status TakeNumber(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(member(s), item.Number());
  return {};
}

Status TakeRig(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, item.Text());
  for (size_t k = 0; k < std::size(kRigNames); ++k) {
    if (name != kRigNames[k]) continue;
    s.views.rig.kind = static_cast<RigKind>(k);
    return {};
  }
  return item.Complain(Cat("unknown rig \"", Printable(name), "\"; known are sphere, rings and random"));
}

template <size_t count>
Result<size_t> ChooseName(const Item& item, const char* const (&names)[count]) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, item.Text());
  std::string known;
  for (size_t k = 0; k < count; ++k) {
    if (name == names[k]) return k;
    known += Cat(k == 0 ? "" : k + 1 == count ? " and " : ", ", names[k]);
  }
  return item.Complain(Cat("\"", Printable(name), "\" is not known; known are ", known));
}

Status TakeStart(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t name, ChooseName(item, kFitStartNames));
  s.start = static_cast<FitStart>(name);
  return {};
}

Status TakeMode(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t name, ChooseName(item, kFitModeNames));
  s.mode = static_cast<RenderMode>(name);
  return {};
}

Status TakePixel(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t name, ChooseName(item, kFitPixelNames));
  s.pixel_area = name == 1;
  return {};
}

Status TakeStrategy(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t name, ChooseName(item, kStrategyNames));
  s.strategy = static_cast<FitPreset>(name);
  return {};
}

Status TakeMipFilter(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(s.mip_filter, item.Flag());
  return {};
}

Status TakeBackdrop(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(s.backdrop, item.Flag());
  return {};
}

Status TakeBackground(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto rgb, item.Numbers());
  if (rgb.size() != 3) return item.Complain("expected three numbers");
  for (size_t k = 0; k < 3; ++k) s.views.background[k] = static_cast<float>(rgb[k]);
  return {};
}

Status TakeElevations(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(s.views.rig.elevations, item.Numbers());
  return {};
}

Status TakeOpaque(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(s.views.opaque, item.Flag());
  return {};
}

Status TakeHigh(const Item& item, ObjectSettings& s) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string word, item.Text());
  if (word != "stored" && word != "on-demand") return item.Complain("expected \"stored\" or \"on-demand\"");
  s.views.store_high = word == "stored";
  return {};
}

const std::map<std::string, Take, std::less<>>& Keys() {
  static const std::map<std::string, Take, std::less<>> keys = {
      {"rig", TakeRig},
      {"views", TakeWhole<[](ObjectSettings& s) -> int& { return s.views.rig.views; }>},
      {"radius", TakeNumber<[](ObjectSettings& s) -> double& { return s.views.rig.radius; }>},
      {"fov", TakeNumber<[](ObjectSettings& s) -> double& { return s.views.rig.fov_degrees; }>},
      {"elevations", TakeElevations},
      {"size", TakeWhole<[](ObjectSettings& s) -> int& { return s.views.high_size; }>},
      {"low_size", TakeWhole<[](ObjectSettings& s) -> int& { return s.views.low_size; }>},
      {"samples", TakeWhole<[](ObjectSettings& s) -> int& { return s.views.trace.samples; }>},
      {"points", TakeWhole<[](ObjectSettings& s) -> int64_t& { return s.views.points; }>},
      {"background", TakeBackground},
      {"opaque", TakeOpaque},
      {"hr", TakeHigh},
      {"steps", TakeWhole<[](ObjectSettings& s) -> int64_t& { return s.fit_steps; }>},
      {"downscale", TakeWhole<[](ObjectSettings& s) -> int& { return s.downscale; }>},
      {"hold_out", TakeWhole<[](ObjectSettings& s) -> int& { return s.hold_out; }>},
      {"max_gaussians", TakeWhole<[](ObjectSettings& s) -> int64_t& { return s.max_gaussians; }>},
      {"min_train_psnr", TakeNumber<[](ObjectSettings& s) -> double& { return s.min_train_psnr; }>},
      {"init", TakeStart},
      {"init_points", TakeWhole<[](ObjectSettings& s) -> int64_t& { return s.init_points; }>},
      {"init_extent", TakeNumber<[](ObjectSettings& s) -> double& { return s.init_extent; }>},
      {"sh_degree", TakeWhole<[](ObjectSettings& s) -> int& { return s.sh_degree; }>},
      {"mode", TakeMode},
      {"pixel", TakePixel},
      {"strategy", TakeStrategy},
      {"mip_filter", TakeMipFilter},
      {"noise", TakeNumber<[](ObjectSettings& s) -> double& { return s.defects.noise; }>},
      {"jpeg", TakeWhole<[](ObjectSettings& s) -> int& { return s.defects.jpeg; }>},
      {"exposure", TakeNumber<[](ObjectSettings& s) -> double& { return s.defects.exposure; }>},
      {"pose", TakeNumber<[](ObjectSettings& s) -> double& { return s.defects.pose; }>},
      {"mask", TakeNumber<[](ObjectSettings& s) -> double& { return s.defects.mask; }>},
      {"defocus", TakeNumber<[](ObjectSettings& s) -> double& { return s.defects.defocus; }>},
      {"backdrop", TakeBackdrop},
  };
  return keys;
}

// Reads settings from `table`, except the keys in `others`.
Status TakeSettings(const std::string& file, const toml::table& table, const std::set<std::string_view>& others,
                    ObjectSettings& settings) {
  for (const auto& [key, node] : table) {
    const std::string_view name = key.str();
    if (others.count(name) > 0) continue;
    const auto known = Keys().find(name);
    const Item item{file, std::string(name), node};
    if (known == Keys().end()) return item.Complain("is not a recipe setting");
    ANCHORSPLAT_RETURN_IF_ERROR(known->second(item, settings));
  }
  return {};
}

bool IsEntryName(const std::string& name) {
  return !name.empty() && name.size() <= 40 && name.front() != '.' && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-';
  });
}

// Keys of an entry other than settings.
const std::set<std::string_view> kEntryKeys = {"name", "weight", "objects"};
const std::set<std::string_view> kDerivedKeys = {"name", "weight", "objects", "from", "after"};

// Reads an entry. `earlier`: entries above it, possible bases of a derived one.
Result<RecipeEntry> TakeEntry(const std::string& file, const toml::table& table, ObjectSettings settings,
                              const std::vector<RecipeEntry>& earlier) {
  const auto complain = [&](const std::string& sentence) {
    return Error{ErrorCode::kBadFile, Cat(file, ": line ", table.source().begin.line, ": [[mix]]: ", sentence)};
  };
  RecipeEntry entry;
  if (const toml::node* from = table.get("from")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string base, (Item{file, "from", *from}.Text()));
    const auto found =
        std::find_if(earlier.begin(), earlier.end(), [&](const RecipeEntry& other) { return other.name == base; });
    if (found == earlier.end()) return complain(Cat("from: no earlier entry is called \"", Printable(base), "\""));
    if (found->settings.IsDerived())
      return complain(Cat("from: \"", base, "\" is itself derived; name the entry it comes from"));
    settings = found->settings;
    settings.from = base;
    entry.objects = found->objects;
    for (const auto& [key, node] : table) {
      if (kDerivedKeys.contains(key.str())) continue;
      return Item{file, std::string(key.str()), node}.Complain(
          "cannot be set with from, which takes all settings of that entry");
    }
    const toml::node* after = table.get("after");
    if (after == nullptr) return complain("from needs after, which says what to do with the splat");
    ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t how, ChooseName(Item{file, "after", *after}, kAfterNames));
    settings.after = kAfterNames[how];
    entry.name = Cat(base, "-", settings.after);
  } else {
    if (const toml::node* after = table.get("after")) return Item{file, "after", *after}.Complain("needs from");
    ANCHORSPLAT_RETURN_IF_ERROR(TakeSettings(file, table, kEntryKeys, settings));
    entry.name = Cat(settings.fit_steps, "-", settings.views.low_size);
  }
  entry.settings = settings;
  if (const toml::node* node = table.get("name")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(entry.name, (Item{file, "name", *node}.Text()));
  }
  if (!IsEntryName(entry.name)) return complain("name must have 1 to 40 letters, digits, '.', '_' and '-'");
  if (const toml::node* node = table.get("weight")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(entry.weight, (Item{file, "weight", *node}.Number()));
    if (!(entry.weight > 0)) return complain("weight must be positive");
  }
  if (const toml::node* node = table.get("objects")) {
    const Item item{file, "objects", *node};
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t objects, item.Whole(1, INT64_MAX));
    if (entry.objects > 0 && objects > entry.objects) {
      return item.Complain(Cat("only ", entry.objects, " objects have the entry it is made from"));
    }
    entry.objects = objects;
  }
  if (const Status status = Validate(entry.settings); !status.ok()) return complain(status.error().message);
  return entry;
}

// Reads `draws`.
Status TakeDraws(const Item& item, Recipe& recipe) {
  if (const auto word = item.node.value_exact<std::string>()) {
    if (*word != "all") return item.Complain("expected a whole number or \"all\"");
    recipe.draws_all = true;
    return {};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t draws, item.Whole(1, INT64_MAX));
  if (draws > std::ssize(recipe.entries)) {
    return item.Complain(Cat("an object cannot be drawn ", draws, " times: the recipe has ", recipe.entries.size(),
                             recipe.entries.size() == 1 ? " entry" : " entries",
                             " ([[mix]]), each drawn at most once"));
  }
  recipe.draws = static_cast<int>(draws);
  return {};
}

Result<Recipe> RecipeFrom(const std::string& file, const toml::table& root, ObjectSettings settings) {
  Recipe recipe;
  recipe.seed = settings.seed;
  if (const toml::node* node = root.get("seed")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t seed, (Item{file, "seed", *node}.Whole(0, INT64_MAX)));
    recipe.seed = static_cast<uint64_t>(seed);
  }
  settings.seed = settings.views.seed = settings.views.rig.seed = recipe.seed;
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSettings(file, root, {"seed", "draws", "mix"}, settings));
  if (const toml::node* mix = root.get("mix")) {
    const toml::array* entries = mix->as_array();
    if (entries == nullptr) return Item{file, "mix", *mix}.Complain("expected [[mix]] tables");
    for (const toml::node& node : *entries) {
      const toml::table* table = node.as_table();
      if (table == nullptr) return Item{file, "mix", node}.Complain("expected [[mix]] tables");
      ANCHORSPLAT_ASSIGN_OR_RETURN(RecipeEntry entry, TakeEntry(file, *table, settings, recipe.entries));
      for (const RecipeEntry& other : recipe.entries) {
        if (other.name == entry.name)
          return Item{file, "mix", node}.Complain(Cat("\"", entry.name, "\" is listed twice"));
      }
      recipe.entries.push_back(std::move(entry));
    }
  }
  if (recipe.entries.empty()) {
    if (const Status status = Validate(settings); !status.ok()) {
      return Error{ErrorCode::kBadFile, Cat(file, ": ", status.error().message)};
    }
    recipe.entries = SingleRecipe(settings).entries;
  }
  if (const toml::node* node = root.get("draws")) {
    ANCHORSPLAT_RETURN_IF_ERROR(TakeDraws(Item{file, "draws", *node}, recipe));
  }
  if (!recipe.draws_all && std::any_of(recipe.entries.begin(), recipe.entries.end(),
                                       [](const RecipeEntry& entry) { return entry.settings.IsDerived(); })) {
    return Error{ErrorCode::kBadFile, Cat(file,
                                          ": entries with from need draws = \"all\", so that every object has "
                                          "the entry they are made from")};
  }
  return recipe;
}

}  // namespace

Recipe SingleRecipe(const ObjectSettings& settings) {
  Recipe recipe;
  recipe.seed = settings.seed;
  recipe.entries.push_back({Cat(settings.fit_steps, "-", settings.views.low_size), 1, 0, settings});
  return recipe;
}

Result<Recipe> ReadRecipe(const std::filesystem::path& path, const ObjectSettings& defaults) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path, kMaxBytes));
  try {
    const toml::table root = toml::parse(text);
    if (root.empty()) {
      return Error{ErrorCode::kBadFile, Cat(path.string(), ": sets nothing; omit --recipe to use the defaults")};
    }
    return RecipeFrom(path.string(), root, defaults);
  } catch (const toml::parse_error& error) {
    return Error{ErrorCode::kBadFile,
                 Cat(path.string(), ": line ", error.source().begin.line, ": not TOML: ", error.description())};
  }
}

std::vector<size_t> DrawEntries(const Recipe& recipe, const std::string& name, int64_t place) {
  const auto may_have = [&](size_t i) { return recipe.entries[i].objects == 0 || place < recipe.entries[i].objects; };
  std::vector<size_t> drawn;
  if (recipe.draws_all) {
    for (size_t i = 0; i < recipe.entries.size(); ++i) {
      if (may_have(i)) drawn.push_back(i);
    }
    return drawn;
  }
  // Efraimidis and Spirakis 2006: the largest u^(1/w) are a weighted sample without replacement.
  Random random(StableHash(name, recipe.seed));
  std::vector<std::pair<double, size_t>> keys;
  for (size_t i = 0; i < recipe.entries.size(); ++i) {
    const double key = std::log(1 - random.Uniform()) / recipe.entries[i].weight;
    if (may_have(i)) keys.emplace_back(key, i);
  }
  std::sort(keys.begin(), keys.end(), std::greater<>());
  for (int i = 0; i < recipe.draws && i < std::ssize(keys); ++i) drawn.push_back(keys[static_cast<size_t>(i)].second);
  return drawn;
}

}  // namespace anchorsplat

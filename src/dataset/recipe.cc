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

// A value of the file and how to complain about it.
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

// Assigns a whole number to a member found by `member`.
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
  };
  return keys;
}

// The settings among the members of `table`; those in `others` are left to the caller.
Status TakeSettings(const std::string& file, const toml::table& table, const std::set<std::string_view>& others,
                    ObjectSettings& settings) {
  for (const auto& [key, node] : table) {
    const std::string_view name = key.str();
    if (others.count(name) > 0) continue;
    const auto known = Keys().find(name);
    const Item item{file, std::string(name), node};
    if (known == Keys().end()) return item.Complain("is not a setting of a recipe");
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

Result<RecipeEntry> TakeEntry(const std::string& file, const toml::table& table, ObjectSettings settings) {
  const auto complain = [&](const std::string& sentence) {
    return Error{ErrorCode::kBadFile, Cat(file, ": line ", table.source().begin.line, ": [[mix]]: ", sentence)};
  };
  RecipeEntry entry;
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSettings(file, table, {"name", "weight"}, settings));
  entry.settings = settings;
  entry.name = Cat(settings.fit_steps, "-", settings.views.low_size);
  if (const toml::node* node = table.get("name")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(entry.name, (Item{file, "name", *node}.Text()));
  }
  if (!IsEntryName(entry.name)) return complain("a name has letters, digits, '.', '_' and '-', 40 at most");
  if (const toml::node* node = table.get("weight")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(entry.weight, (Item{file, "weight", *node}.Number()));
    if (!(entry.weight > 0)) return complain("weight is not positive");
  }
  if (const Status status = Validate(entry.settings); !status.ok()) return complain(status.error().message);
  return entry;
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
      ANCHORSPLAT_ASSIGN_OR_RETURN(RecipeEntry entry, TakeEntry(file, *table, settings));
      for (const RecipeEntry& other : recipe.entries) {
        if (other.name == entry.name)
          return Item{file, "mix", node}.Complain(Cat("\"", entry.name, "\" is there twice"));
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
    const Item item{file, "draws", *node};
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t draws, item.Whole(1, INT64_MAX));
    if (draws > std::ssize(recipe.entries)) {
      return item.Complain(Cat("an object cannot be drawn ", draws, " times: the recipe has ", recipe.entries.size(),
                               recipe.entries.size() == 1 ? " entry" : " entries",
                               " ([[mix]]), and each is drawn once at most"));
    }
    recipe.draws = static_cast<int>(draws);
  }
  return recipe;
}

}  // namespace

Recipe SingleRecipe(const ObjectSettings& settings) {
  Recipe recipe;
  recipe.seed = settings.seed;
  recipe.entries.push_back({Cat(settings.fit_steps, "-", settings.views.low_size), 1, settings});
  return recipe;
}

Result<Recipe> ReadRecipe(const std::filesystem::path& path, const ObjectSettings& defaults) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path, kMaxBytes));
  try {
    return RecipeFrom(path.string(), toml::parse(text), defaults);
  } catch (const toml::parse_error& error) {
    return Error{ErrorCode::kBadFile,
                 Cat(path.string(), ": line ", error.source().begin.line, ": not TOML: ", error.description())};
  }
}

std::vector<size_t> DrawEntries(const Recipe& recipe, const std::string& name) {
  // Efraimidis and Spirakis 2006: the largest u^(1/w) are a weighted sample without replacement.
  Random random(StableHash(name, recipe.seed));
  std::vector<std::pair<double, size_t>> keys;
  for (size_t i = 0; i < recipe.entries.size(); ++i) {
    keys.emplace_back(std::log(1 - random.Uniform()) / recipe.entries[i].weight, i);
  }
  std::sort(keys.begin(), keys.end(), std::greater<>());
  std::vector<size_t> drawn;
  for (int i = 0; i < recipe.draws && i < std::ssize(keys); ++i) drawn.push_back(keys[static_cast<size_t>(i)].second);
  return drawn;
}

}  // namespace anchorsplat

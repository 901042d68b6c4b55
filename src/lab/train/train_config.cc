#include "train/train_config.h"

#include <toml++/toml.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/text.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMaxBytes = uint64_t{1} << 20;
constexpr int64_t kManySteps = 1'000'000'000;
constexpr double kMostUpscale = 64;

// Reads the keys of a table; unread keys are errors. Keeps the first error.
class TableReader {
 public:
  TableReader(const std::string& file, const toml::table* table, std::string name)
      : file_(file), table_(table), name_(std::move(name)) {}

  void Number(const char* key, double low, double high, double& value) {
    const toml::node* node = Take(key);
    if (node == nullptr) return;
    const auto given = node->is_number() ? node->value<double>() : std::nullopt;
    if (given && *given >= low && *given <= high) {
      value = *given;
    } else {
      Complain(key, *node, Cat("expected a number from ", low, " to ", high));
    }
  }
  template <typename Whole>
  void Int(const char* key, int64_t low, int64_t high, Whole& value) {
    const toml::node* node = Take(key);
    if (node == nullptr) return;
    const auto given = node->value_exact<int64_t>();
    if (given && *given >= low && *given <= high) {
      value = static_cast<Whole>(*given);
    } else {
      Complain(key, *node, Cat("expected a whole number from ", low, " to ", high));
    }
  }
  void Ints(const char* key, int64_t low, int64_t high, std::vector<int64_t>& values) {
    const toml::node* node = Take(key);
    if (node == nullptr) return;
    std::vector<int64_t> given;
    if (const toml::array* array = node->as_array()) {
      for (const toml::node& element : *array) {
        const auto value = element.value_exact<int64_t>();
        if (value && *value >= low && *value <= high) given.push_back(*value);
      }
      if (!given.empty() && given.size() == array->size()) {
        values = std::move(given);
        return;
      }
    }
    Complain(key, *node, Cat("expected a list of whole numbers from ", low, " to ", high));
  }
  void Flag(const char* key, bool& value) {
    const toml::node* node = Take(key);
    if (node == nullptr) return;
    if (const auto given = node->value_exact<bool>()) {
      value = *given;
    } else {
      Complain(key, *node, "expected true or false");
    }
  }
  std::optional<std::string> Text(const char* key) {
    const toml::node* node = Take(key);
    if (node == nullptr) return std::nullopt;
    if (auto given = node->value_exact<std::string>()) return given;
    Complain(key, *node, "expected a string");
    return std::nullopt;
  }
  template <typename Value>
  void Choice(const char* key, const std::vector<std::pair<const char*, Value>>& choices, Value& value) {
    const auto word = Text(key);
    if (!word) return;
    std::string list;
    for (const auto& [name, meaning] : choices) {
      if (*word == name) {
        value = meaning;
        return;
      }
      list += Cat(list.empty() ? "\"" : ", \"", name, "\"");
    }
    Complain(key, *table_->get(key), Cat("expected one of ", list, ", not \"", Printable(*word), "\""));
  }
  // A table inside this one.
  TableReader Table(const char* key) {
    const toml::node* node = Take(key);
    if (node != nullptr && !node->is_table()) Complain(key, *node, Cat("expected a table [", key, "]"));
    return {file_, node == nullptr ? nullptr : node->as_table(), name_.empty() ? key : Cat(name_, ".", key)};
  }

  const toml::table* rest() const { return table_; }
  void TakeAll() {
    if (table_ == nullptr) return;
    for (const auto& [key, node] : *table_) taken_.insert(std::string(key.str()));
  }
  void Complain(const std::string& key, const toml::node& node, const std::string& sentence) {
    if (!first_.ok()) return;
    first_ = Error{ErrorCode::kBadFile, Cat(file_, ": line ", node.source().begin.line, ": ",
                                            name_.empty() ? "" : Cat(name_, "."), Printable(key), ": ", sentence)};
  }
  Status Finish() {
    if (first_.ok() && table_ != nullptr) {
      for (const auto& [key, node] : *table_) {
        if (taken_.count(std::string(key.str())) == 0) {
          Complain(std::string(key.str()), node, "unknown setting");
          break;
        }
      }
    }
    return first_;
  }

 private:
  const toml::node* Take(const char* key) {
    taken_.insert(key);
    return table_ == nullptr ? nullptr : table_->get(key);
  }

  const std::string& file_;
  const toml::table* table_;  // null if the file has none
  std::string name_;
  std::set<std::string> taken_;
  Status first_;
};

Status TakeNetwork(TableReader table, TrainConfig& config) {
  if (const auto kind = table.Text("kind")) config.kind = *kind;
  if (table.rest() != nullptr && table.rest()->get("kind") != nullptr) {
    config.network_lines["kind"] = static_cast<int>(table.rest()->get("kind")->source().begin.line);
  }
  if (table.rest() != nullptr) {
    for (const auto& [key, node] : *table.rest()) {
      const std::string name(key.str());
      if (name == "kind") continue;
      config.network_lines[name] = static_cast<int>(node.source().begin.line);
      if (const auto flag = node.value_exact<bool>()) {
        config.network[name] = *flag;
      } else if (node.is_number()) {
        config.network[name] = *node.value<double>();
      } else if (const auto text = node.value_exact<std::string>()) {
        config.network[name] = *text;
      } else if (const toml::array* array = node.as_array()) {
        std::vector<double> values;
        for (const toml::node& element : *array) {
          if (!element.is_number()) table.Complain(name, element, "expected numbers in its list");
          values.push_back(element.value<double>().value_or(0));
        }
        config.network[name] = std::move(values);
      } else {
        table.Complain(name, node, "expected a number, a string, true or false, or a list of numbers");
      }
    }
  }
  table.TakeAll();
  return table.Finish();
}

Status TakeLoss(const std::string& file, TableReader table, LossConfig& loss) {
  table.Number("l1", 0, 1e6, loss.l1);
  table.Number("ssim", 0, 1e6, loss.ssim);
  table.Number("mse", 0, 1e6, loss.mse);
  table.Number("log_mse", 0, 1e6, loss.log_mse);
  table.Number("lpips", 0, 1e6, loss.lpips);
  table.Choice<LpipsNet>("lpips_net",
                         {{"alex", LpipsNet::kAlex}, {"vgg", LpipsNet::kVgg}, {"squeeze", LpipsNet::kSqueeze}},
                         loss.lpips_net);
  table.Int("lpips_crop", 0, 1 << 14, loss.lpips_crop);
  ANCHORSPLAT_RETURN_IF_ERROR(table.Finish());
  if (loss.l1 + loss.ssim + loss.mse + loss.log_mse + loss.lpips > 0) return {};
  return Error{ErrorCode::kBadFile, Cat(file, ": loss: all weights are 0, so there is nothing to learn")};
}

Status TakeOptimizer(const std::string& file, TableReader table, OptimizerConfig& o) {
  table.Number("learning_rate", 0, 10, o.learning_rate);
  table.Number("beta1", 0, 0.999999, o.beta1);
  table.Number("beta2", 0, 0.999999, o.beta2);
  table.Number("epsilon", 0, 1, o.epsilon);
  table.Number("weight_decay", 0, 10, o.weight_decay);
  table.Number("clip", 0, 1e9, o.clip);
  table.Choice<Schedule>("schedule", {{"cosine", Schedule::kCosine}, {"constant", Schedule::kConstant}}, o.schedule);
  table.Int("warm_up", 0, kManySteps, o.warm_up);
  table.Number("final", 0, 1, o.final);
  table.Number("ema", 0, 0.999999, o.ema);
  TableReader groups = table.Table("groups");
  if (groups.rest() != nullptr) {
    for (const auto& [key, node] : *groups.rest()) {
      const std::string name(key.str());
      groups.Number(name.c_str(), 0, 10, o.groups[name]);
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(groups.Finish());
  if (o.epsilon == 0) return Error{ErrorCode::kBadFile, Cat(file, ": optimizer.epsilon: expected a positive number")};
  return table.Finish();
}

Status TakeData(const std::string& file, TableReader table, DataConfig& data) {
  table.Int("views_per_object", 0, 100000, data.views_per_object);
  table.Int("scenes_per_step", 1, 1024, data.scenes_per_step);
  table.Int("views_per_step", 1, 1024, data.views_per_step);
  table.Int("crop", 0, 1 << 14, data.crop);
  table.Int("part", 0, 1'000'000'000, data.part);
  table.Flag("fixed_views", data.fixed_views);
  table.Int("objects_in_memory", 1, 1'000'000, data.objects_in_memory);
  table.Number("least_upscale", 0, kMostUpscale, data.least_upscale);
  table.Number("greatest_upscale", 0, kMostUpscale, data.greatest_upscale);
  table.Number("least_merge_cost", 0, 1, data.least_merge_cost);
  table.Number("greatest_merge_cost", 0, 1, data.greatest_merge_cost);
  ANCHORSPLAT_RETURN_IF_ERROR(table.Finish());
  if (data.greatest_merge_cost > 0 ? !(data.least_merge_cost > 0 && data.least_merge_cost <= data.greatest_merge_cost)
                                   : data.least_merge_cost > 0) {
    return Error{ErrorCode::kBadFile, Cat(file,
                                          ": data.least_merge_cost and greatest_merge_cost: expected positive numbers, "
                                          "the second not below the first, or neither")};
  }
  const bool range = data.least_upscale >= 1 && data.greatest_upscale >= data.least_upscale;
  if (!range && (data.least_upscale > 0 || data.greatest_upscale > 0)) {
    return Error{ErrorCode::kBadFile, Cat(file,
                                          ": data.least_upscale and greatest_upscale: expected 1 or more, the "
                                          "second not below the first, or neither")};
  }
  return {};
}

Status TakeCaptures(TableReader table, CapturesConfig& captures) {
  table.Int("downscale", 2, kMostUpscale, captures.downscale);
  table.Int("hold_out", 2, 1000, captures.hold_out);
  table.Ints("fit_steps", 1, 1'000'000, captures.fit_steps);
  return table.Finish();
}

Status TakeAugmentation(TableReader table, AugmentationConfig& a) {
  table.Flag("rotate", a.rotate);
  table.Flag("mirror", a.mirror);
  table.Number("scale", 0, 5, a.scale);
  table.Flag("permute_colors", a.permute_colors);
  table.Number("gain", 0, 1, a.gain);
  table.Number("drop", 0, 0.9, a.drop);
  table.Number("opacity_noise", 0, 10, a.opacity_noise);
  table.Number("pixel_size_noise", 0, 2, a.pixel_size_noise);
  table.Number("strength_noise", 0, 2, a.strength_noise);
  return table.Finish();
}

Status TakeValidation(TableReader table, ValidationConfig& v) {
  table.Int("every", 0, kManySteps, v.every);
  table.Int("views", 0, 100000, v.views);
  table.Int("objects", 0, 1'000'000, v.objects);
  table.Flag("lpips", v.lpips);
  return table.Finish();
}

Result<TrainConfig> ConfigFrom(const std::string& file, const toml::table& root) {
  TrainConfig config;
  config.file = file;
  TableReader table(file, &root, "");
  table.Int("seed", 0, INT64_MAX, config.seed);
  table.Int("steps", 1, kManySteps, config.steps);
  table.Choice<Precision>("precision",
                          {{"fp32", Precision::kFp32}, {"bf16", Precision::kBf16}, {"fp16", Precision::kFp16}},
                          config.precision);
  table.Choice<std::string>("device", {{"cpu", "cpu"}, {"cuda", "cuda"}, {"auto", "auto"}}, config.device);
  table.Int("checkpoint_every", 0, kManySteps, config.checkpoint_every);
  table.Int("log_every", 1, kManySteps, config.log_every);
  ANCHORSPLAT_RETURN_IF_ERROR(TakeNetwork(table.Table("network"), config));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeLoss(file, table.Table("loss"), config.loss));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeOptimizer(file, table.Table("optimizer"), config.optimizer));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeData(file, table.Table("data"), config.data));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeCaptures(table.Table("captures"), config.captures));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeAugmentation(table.Table("augmentation"), config.augmentation));
  ANCHORSPLAT_RETURN_IF_ERROR(TakeValidation(table.Table("validation"), config.validation));
  ANCHORSPLAT_RETURN_IF_ERROR(table.Finish());
  if (config.data.part > 0 && config.augmentation.drop > 0) {
    return Error{ErrorCode::kBadFile,
                 Cat(file, ": data.part: cannot be used with augmentation.drop, which changes the neighbours")};
  }
  return config;
}

nlohmann::json ToJson(const NetworkOptionValue& value) {
  return std::visit([](const auto& v) { return nlohmann::json(v); }, value);
}

}  // namespace

Result<TrainConfig> ParseTrainConfig(const std::string& text, const std::string& name) {
  try {
    return ConfigFrom(name, toml::parse(text));
  } catch (const toml::parse_error& error) {
    return Error{ErrorCode::kBadFile,
                 Cat(name, ": line ", error.source().begin.line, ": not TOML: ", error.description())};
  }
}

Result<TrainConfig> ReadTrainConfig(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path, kMaxBytes));
  return ParseTrainConfig(text, path.string());
}

nlohmann::json Settings(const TrainConfig& c) {
  nlohmann::json json = {{"seed", Cat(c.seed)},
                         {"precision", static_cast<int>(c.precision)},
                         {"network.kind", c.kind},
                         {"loss.l1", c.loss.l1},
                         {"loss.ssim", c.loss.ssim},
                         {"loss.mse", c.loss.mse},
                         {"loss.log_mse", c.loss.log_mse},
                         {"loss.lpips", c.loss.lpips},
                         {"loss.lpips_net", LpipsNetName(c.loss.lpips_net)},
                         {"loss.lpips_crop", c.loss.lpips_crop},
                         {"optimizer.learning_rate", c.optimizer.learning_rate},
                         {"optimizer.beta1", c.optimizer.beta1},
                         {"optimizer.beta2", c.optimizer.beta2},
                         {"optimizer.epsilon", c.optimizer.epsilon},
                         {"optimizer.weight_decay", c.optimizer.weight_decay},
                         {"optimizer.clip", c.optimizer.clip},
                         {"optimizer.schedule", c.optimizer.schedule == Schedule::kCosine ? "cosine" : "constant"},
                         {"optimizer.warm_up", c.optimizer.warm_up},
                         {"optimizer.final", c.optimizer.final},
                         {"optimizer.ema", c.optimizer.ema},
                         {"data.views_per_object", c.data.views_per_object},
                         {"data.scenes_per_step", c.data.scenes_per_step},
                         {"data.views_per_step", c.data.views_per_step},
                         {"data.crop", c.data.crop},
                         {"data.part", c.data.part},
                         {"data.fixed_views", c.data.fixed_views},
                         {"augmentation.rotate", c.augmentation.rotate},
                         {"augmentation.mirror", c.augmentation.mirror},
                         {"augmentation.scale", c.augmentation.scale},
                         {"augmentation.permute_colors", c.augmentation.permute_colors},
                         {"augmentation.gain", c.augmentation.gain},
                         {"augmentation.drop", c.augmentation.drop},
                         {"augmentation.opacity_noise", c.augmentation.opacity_noise},
                         {"augmentation.pixel_size_noise", c.augmentation.pixel_size_noise}};
  // Omitted when off, so that trainings begun before this option can resume.
  if (c.augmentation.strength_noise > 0) json["augmentation.strength_noise"] = c.augmentation.strength_noise;
  if (c.data.least_upscale > 0) {
    json["data.least_upscale"] = c.data.least_upscale;
    json["data.greatest_upscale"] = c.data.greatest_upscale;
  }
  if (c.data.greatest_merge_cost > 0) {
    json["data.least_merge_cost"] = c.data.least_merge_cost;
    json["data.greatest_merge_cost"] = c.data.greatest_merge_cost;
  }
  if (c.captures != CapturesConfig()) {
    json["captures.downscale"] = c.captures.downscale;
    json["captures.hold_out"] = c.captures.hold_out;
    json["captures.fit_steps"] = c.captures.fit_steps;
  }
  for (const auto& [group, rate] : c.optimizer.groups) json[Cat("optimizer.groups.", group)] = rate;
  for (const auto& [key, value] : c.network) json[Cat("network.", key)] = ToJson(value);
  return json;
}

Error InNetworkTable(const TrainConfig& config, const Error& error) {
  const std::string key = error.message.substr(0, error.message.find(':'));
  const auto line = config.network_lines.find(key);
  if (line == config.network_lines.end()) {
    return {ErrorCode::kBadFile, Cat(config.file, ": network: ", error.message)};
  }
  return {ErrorCode::kBadFile, Cat(config.file, ": line ", line->second, ": network.", error.message)};
}

}  // namespace anchorsplat

#include "compact/compact_config.h"

#include <algorithm>
#include <charconv>
#include <set>
#include <span>

#include "compact/compact_features.h"
#include "core/number_text.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr const char* kPrefix = "option.";

class MetadataWriter {
 public:
  void Integer(const std::string& key, int64_t, int64_t, int64_t value) { metadata[kPrefix + key] = Cat(value); }
  void Flag(const std::string& key, bool value) { metadata[kPrefix + key] = value ? "true" : "false"; }
  void Number(const std::string& key, double, double, double value) {
    char text[32];
    const auto [end, code] = std::to_chars(text, text + sizeof(text), value);  // the shortest that reads back the same
    metadata[kPrefix + key] = code == std::errc() ? std::string(text, end) : Cat(value);
  }
  void Text(const std::string& key, const std::vector<std::string>&, const std::string& value) {
    metadata[kPrefix + key] = value;
  }

  std::map<std::string, std::string> metadata;
};

class MetadataReader {
 public:
  explicit MetadataReader(const std::map<std::string, std::string>& metadata) : metadata_(metadata) {}

  void Integer(const std::string& key, int64_t low, int64_t high, int64_t& value) {
    Parse(key, low, high, "a whole number", value);
  }
  void Number(const std::string& key, double low, double high, double& value) {
    Parse(key, low, high, "a number", value);
  }
  void Flag(const std::string& key, bool& value) {
    const std::string* text = Find(key);
    if (text == nullptr) return;
    if (*text != "true" && *text != "false") return Complain(key, "true or false");
    value = *text == "true";
  }
  void Text(const std::string& key, const std::vector<std::string>& choices, std::string& value) {
    const std::string* text = Find(key);
    if (text == nullptr) return;
    if (std::find(choices.begin(), choices.end(), *text) == choices.end()) {
      std::string list;
      for (const std::string& choice : choices) list += (list.empty() ? "" : ", ") + choice;
      return Complain(key, "one of " + list);
    }
    value = *text;
  }

  Status Finish() const {
    if (!first_.ok()) return first_;
    for (const auto& [key, value] : metadata_) {
      if (key.starts_with(kPrefix) && !known_.contains(key)) {
        return Error{ErrorCode::kBadFile, Cat("its metadata has \"", Printable(key),
                                              "\", an option that compact networks do not have here")};
      }
    }
    return {};
  }

 private:
  const std::string* Find(const std::string& key) {
    known_.insert(kPrefix + key);
    const auto found = metadata_.find(kPrefix + key);
    return found == metadata_.end() ? nullptr : &found->second;
  }
  void Complain(const std::string& key, const std::string& expected) {
    if (!first_.ok()) return;
    first_ = Error{ErrorCode::kBadFile, Cat("its metadata says ", kPrefix, key, " \"",
                                            Printable(metadata_.at(kPrefix + key)), "\"; expected ", expected)};
  }
  template <typename T>
  void Parse(const std::string& key, T low, T high, const char* kind, T& value) {
    const std::string* text = Find(key);
    if (text == nullptr) return;
    T parsed{};
    const char* end = text->data() + text->size();
    const auto [stop, code] = FromChars(text->data(), end, parsed);
    if (code != std::errc() || stop != end || !(parsed >= low && parsed <= high)) {
      return Complain(key, Cat(kind, " from ", low, " to ", high));
    }
    value = parsed;
  }

  const std::map<std::string, std::string>& metadata_;
  std::set<std::string> known_;
  Status first_;
};

}  // namespace

Status Validate(const CompactConfig& config) {
  for (const auto& [key, width] : {std::pair{"hidden", config.hidden}, {"head_hidden", config.head_hidden}}) {
    if (width % 16 != 0) return Error{ErrorCode::kBadArgument, Cat(key, ": ", width, " is not a multiple of 16")};
  }
  return {};
}

std::map<std::string, std::string> ToMetadata(const CompactConfig& config) {
  MetadataWriter writer;
  CompactConfig copy = config;
  VisitCompactOptions(copy, writer);
  writer.metadata["format"] = kCompactFormat;
  return writer.metadata;
}

Result<CompactConfig> CompactConfigFromMetadata(const std::map<std::string, std::string>& metadata) {
  CompactConfig config;
  MetadataReader reader(metadata);
  VisitCompactOptions(config, reader);
  ANCHORSPLAT_RETURN_IF_ERROR(reader.Finish());
  const Status valid = Validate(config);
  if (!valid.ok()) return Error{ErrorCode::kBadFile, Cat("its metadata says option.", valid.error().message)};
  return config;
}

std::span<const CompactAttribute> CopyAttributes(const CompactConfig& config) {
  const std::span<const CompactAttribute> all = kCopyAttributes;
  return config.sh ? all : all.first(kAttributesWithoutSh);
}

int64_t ChannelsPerCopy(const CompactConfig& config) {
  int64_t sum = 0;
  for (const CompactAttribute& attribute : CopyAttributes(config)) sum += attribute.channels;
  return sum;
}

int64_t CompactOutputs(const CompactConfig& config) { return 1 + config.copies * ChannelsPerCopy(config); }

int64_t NodeFeatures(const CompactConfig& config) { return config.knows_kind ? kMostNodeFeatures : kNodeFeatures; }

std::vector<TensorSpec> CompactTensors(const CompactConfig& config) {
  std::vector<TensorSpec> tensors;
  const auto linear = [&](const std::string& name, int64_t outputs, int64_t inputs, bool bias = true) {
    tensors.push_back({name + ".weight", {outputs, inputs}});
    if (bias) tensors.push_back({name + ".bias", {outputs}});
  };
  const auto norm = [&](const std::string& name) {
    tensors.push_back({name + ".weight", {config.hidden}});
    tensors.push_back({name + ".bias", {config.hidden}});
  };
  const int64_t h = config.hidden, g = config.head_hidden, told = NodeFeatures(config);
  linear("embed.first", h, told);
  linear("embed.second", h, h);
  norm("embed.norm");
  for (int64_t r = 0; r < config.rounds; ++r) {
    const std::string round = Cat("rounds.", r, ".");
    linear(round + "own", h, h);
    linear(round + "other", h, h, /*bias=*/false);
    linear(round + "edge", h, kEdgeFeatures, /*bias=*/false);
    linear(round + "message", h, h);
    linear(round + "update_first", h, 3 * h);
    linear(round + "update_second", h, h);
    norm(round + "norm");
  }
  linear("head.first", g, h + told);
  linear("head.second", g, g);
  linear(std::string("out.") + kStrengthAttribute.name, 1, g);
  for (const CompactAttribute& attribute : CopyAttributes(config)) {
    linear(std::string("out.") + attribute.name, config.copies * attribute.channels, g);
  }
  tensors.push_back({"domain.low", {told}});
  tensors.push_back({"domain.high", {told}});
  return tensors;
}

}  // namespace anchorsplat

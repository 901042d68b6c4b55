#include <algorithm>
#include <set>
#include <utility>

#include "compact/compact_network.h"
#include "core/fingerprint.h"
#include "core/finite.h"
#include "core/log.h"
#include "core/text.h"

namespace anchorsplat {

class CompactNetwork::Loader {
 public:
  Loader(const CompactConfig& config, const WeightSource& source) : tensors_(CompactTensors(config)), source_(source) {
    for (const auto& [key, value] : ToMetadata(config)) fingerprint_.Add(key + '=' + value + '\n');
  }

  Result<std::vector<float>> Read(const std::string& name) const {
    const auto spec = std::find_if(tensors_.begin(), tensors_.end(), [&](const auto& t) { return t.name == name; });
    int64_t count = 1;
    for (const int64_t side : spec->shape) count *= side;
    std::vector<float> values(static_cast<size_t>(count));
    ANCHORSPLAT_RETURN_IF_ERROR(source_(*spec, values));
    ANCHORSPLAT_RETURN_IF_ERROR(CheckFinite(name, values));
    fingerprint_.AddWords(values);
    return values;
  }
  std::string fingerprint() const { return fingerprint_.text(); }  // of everything read
  bool Has(const std::string& name) const {
    return std::any_of(tensors_.begin(), tensors_.end(), [&](const auto& t) { return t.name == name; });
  }
  Status Into(const std::string& name, PackedWeights& out) const {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto weight, Read(name + ".weight"));
    const auto spec =
        std::find_if(tensors_.begin(), tensors_.end(), [&](const auto& t) { return t.name == name + ".weight"; });
    std::vector<float> bias;
    if (Has(name + ".bias")) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(bias, Read(name + ".bias"));
    }
    out = PackedWeights(weight.data(), bias.empty() ? nullptr : bias.data(), spec->shape[0], spec->shape[1]);
    return {};
  }
  Status Into(const std::string& name, Norm& out) const {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto weight, Read(name + ".weight"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto bias, Read(name + ".bias"));
    out.weight.assign(weight.begin(), weight.end());
    out.bias.assign(bias.begin(), bias.end());
    return {};
  }

  // All attributes' output layers as one, rows in the order WriteCopies reads.
  Status Outputs(const CompactConfig& config, PackedWeights& out) const {
    const int64_t inputs = config.head_hidden, outputs = CompactOutputs(config), per_copy = ChannelsPerCopy(config);
    std::vector<float> weights(static_cast<size_t>(outputs * inputs)), biases(static_cast<size_t>(outputs));
    const auto place = [&](const CompactAttribute& attribute, int64_t copies, int64_t first, int64_t stride) -> Status {
      const std::string name = std::string("out.") + attribute.name;
      ANCHORSPLAT_ASSIGN_OR_RETURN(const auto weight, Read(name + ".weight"));
      ANCHORSPLAT_ASSIGN_OR_RETURN(const auto bias, Read(name + ".bias"));
      for (int64_t k = 0; k < copies; ++k) {
        const int64_t to = first + k * stride, from = k * attribute.channels;
        std::copy_n(weight.begin() + from * inputs, attribute.channels * inputs, weights.begin() + to * inputs);
        std::copy_n(bias.begin() + from, attribute.channels, biases.begin() + to);
      }
      return {};
    };
    ANCHORSPLAT_RETURN_IF_ERROR(place(kStrengthAttribute, 1, 0, 0));
    int64_t first = 1;
    for (const CompactAttribute& attribute : CopyAttributes(config)) {
      ANCHORSPLAT_RETURN_IF_ERROR(place(attribute, config.copies, first, per_copy));
      first += attribute.channels;
    }
    out = PackedWeights(weights.data(), biases.data(), outputs, inputs);
    return {};
  }

 private:
  std::vector<TensorSpec> tensors_;
  const WeightSource& source_;
  mutable Fingerprint fingerprint_;
};

Result<CompactNetwork> CompactNetwork::Load(const CompactConfig& config, const WeightSource& source) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(config));
  const Loader loader(config, source);
  CompactNetwork network;
  network.config_ = config;
  ANCHORSPLAT_RETURN_IF_ERROR(loader.Into("embed.first", network.embed_first_));
  ANCHORSPLAT_RETURN_IF_ERROR(loader.Into("embed.second", network.embed_second_));
  ANCHORSPLAT_RETURN_IF_ERROR(loader.Into("embed.norm", network.embed_norm_));
  for (int64_t r = 0; r < config.rounds; ++r) {
    Round& round = network.rounds_.emplace_back();
    const std::string name = Cat("rounds.", r, ".");
    ANCHORSPLAT_RETURN_IF_ERROR(loader.Into(name + "own", round.own));
    ANCHORSPLAT_RETURN_IF_ERROR(loader.Into(name + "other", round.other));
    ANCHORSPLAT_RETURN_IF_ERROR(loader.Into(name + "edge", round.edge));
    ANCHORSPLAT_RETURN_IF_ERROR(loader.Into(name + "message", round.message));
    ANCHORSPLAT_RETURN_IF_ERROR(loader.Into(name + "update_first", round.update_first));
    ANCHORSPLAT_RETURN_IF_ERROR(loader.Into(name + "update_second", round.update_second));
    ANCHORSPLAT_RETURN_IF_ERROR(loader.Into(name + "norm", round.norm));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(loader.Into("head.first", network.head_first_));
  ANCHORSPLAT_RETURN_IF_ERROR(loader.Into("head.second", network.head_second_));
  ANCHORSPLAT_RETURN_IF_ERROR(loader.Outputs(config, network.out_));
  ANCHORSPLAT_ASSIGN_OR_RETURN(network.low_, loader.Read("domain.low"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(network.high_, loader.Read("domain.high"));
  network.fingerprint_ = loader.fingerprint();
  return network;
}

bool IsCompactNetwork(const TensorFile& file) {
  const auto format = file.metadata().find("format");
  return format != file.metadata().end() && format->second == kCompactFormat;
}

Result<CompactNetwork> LoadCompactNetwork(const TensorFile& file) {
  const auto bad = [&](const std::string& message) {
    return Error{ErrorCode::kBadFile,
                 message.find(file.name()) == std::string::npos ? Cat(file.name(), ": ", message) : message};
  };
  const auto config = CompactConfigFromMetadata(file.metadata());
  if (!config.ok()) return bad(config.error().message);
  std::set<std::string> expected;
  for (const TensorSpec& tensor : CompactTensors(*config)) expected.insert(tensor.name);
  for (const TensorEntry& entry : file.tensors()) {
    if (!expected.contains(entry.name)) {
      return bad(Cat("tensor \"", Printable(entry.name), "\" belongs to no part of the network"));
    }
  }
  auto network = CompactNetwork::Load(*config, [&](const TensorSpec& tensor, std::span<float> values) -> Status {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values read, file.ReadFloat32(tensor.name, tensor.shape));
    std::copy(read.values().begin(), read.values().end(), values.begin());
    return {};
  });
  if (!network.ok()) return bad(network.error().message);
  if (!network->HasTrainingRange()) {
    LogWarning(
        Cat(file.name(),
            ": has no range of training data (domain.low is above domain.high), so no Gaussian counts as unlike it"));
  }
  return network;
}

}  // namespace anchorsplat

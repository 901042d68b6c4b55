#include "published/published_checkpoint.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr const char* kArchitecture = "architecture";  // informative only

// The first few names, and the number of the rest.
std::string SomeOf(const std::vector<std::string>& names) {
  constexpr size_t kShown = 3;
  std::string text;
  for (size_t i = 0; i < std::min(kShown, names.size()); ++i) {
    text += Cat(i > 0 ? ", " : "", "\"", Printable(names[i]), "\"");
  }
  if (names.size() > kShown) text += Cat(" and ", names.size() - kShown, " more");
  return text;
}

std::string List(const std::vector<int64_t>& values) {
  std::string out;
  for (const int64_t value : values) out += (out.empty() ? "" : ",") + std::to_string(value);
  return out;
}

}  // namespace

std::map<std::string, std::string> ArchitectureMetadata(const PublishedConfig& config) {
  return {{kArchitecture, "AnchorSplat: Point Transformer V3 U-Net and six residual heads"},
          {"K", std::to_string(config.copies)},
          {"epsilon", Cat(kAnchorOffsetScale)},
          {"grid_resolution", std::to_string(kGridResolution)},
          {"patch_size", std::to_string(config.patch_size)},
          {"encoder_channels", List(config.encoder_channels)},
          {"encoder_blocks", List(config.encoder_blocks)},
          {"encoder_heads", List(config.encoder_heads)},
          {"decoder_channels", List(config.decoder_channels)},
          {"decoder_blocks", List(config.decoder_blocks)},
          {"decoder_heads", List(config.decoder_heads)}};
}

Result<Checkpoint> Checkpoint::Open(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(TensorFile file, TensorFile::Open(path));
  const auto bad = [&](const std::string& message) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": ", message)};
  };

  std::vector<TensorSpec> found;
  for (const TensorEntry& entry : file.tensors()) found.push_back({entry.name, entry.shape});
  const auto config = ConfigOfTensors(found);
  if (!config.ok()) return bad(config.error().message);

  for (const auto& [key, value] : ArchitectureMetadata(*config)) {
    const auto said = file.metadata().find(key);
    if (key != kArchitecture && said != file.metadata().end() && said->second != value) {
      return bad(
          Cat("its metadata says ", key, " ", Printable(said->second), ", and only ", value, " is implemented here"));
    }
  }

  // Missing tensors first: a wrong shape often follows from them.
  std::vector<std::string> missing, unknown;
  std::set<std::string> expected;
  const std::vector<TensorSpec> tensors = PublishedTensors(*config);
  for (const TensorSpec& tensor : tensors) {
    expected.insert(tensor.name);
    if (!tensor.counter && file.Find(tensor.name) == nullptr) missing.push_back(tensor.name);
  }
  for (const TensorSpec& tensor : found) {
    if (!expected.contains(tensor.name)) unknown.push_back(tensor.name);
  }
  if (!missing.empty()) return bad(Cat(missing.size(), " tensors are missing: ", SomeOf(missing)));
  if (!unknown.empty()) {
    return bad(Cat(unknown.size(), " tensors belong to no part of the network: ", SomeOf(unknown)));
  }
  for (const TensorSpec& tensor : tensors) {
    if (tensor.counter) continue;
    const TensorEntry& entry = *file.Find(tensor.name);
    if (entry.shape != tensor.shape) {
      return bad(Cat("tensor \"", tensor.name, "\" has the shape ", ShapeText(entry.shape),
                     ", but the other tensors ask for ", ShapeText(tensor.shape)));
    }
  }
  return Checkpoint(std::move(file), *config);
}

WeightSource Checkpoint::Weights() const {
  return [this](const TensorSpec& tensor, std::span<float> values) -> Status {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values read, file_.ReadFloat32(tensor.name, tensor.shape));
    std::copy(read.values().begin(), read.values().end(), values.begin());
    return {};
  };
}

Result<PublishedNetwork> LoadPublishedNetwork(const std::filesystem::path& path, WeightPrecision precision) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Checkpoint checkpoint, Checkpoint::Open(path));
  auto network = PublishedNetwork::Load(checkpoint.config(), checkpoint.Weights(), precision);
  if (!network.ok() && network.error().message.find(checkpoint.file().name()) == std::string::npos) {
    return Error{network.error().code, Cat(checkpoint.file().name(), ": ", network.error().message)};
  }
  return network;
}

}  // namespace anchorsplat

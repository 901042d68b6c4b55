#include "train/train_checkpoint.h"

#include <nlohmann/json.hpp>
#include <span>

#include "core/text.h"
#include "io/input_record.h"
#include "tensors/safetensors.h"
#include "tensors/tensor_checksum.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

constexpr const char* kFormat = "anchorsplat training 2";
constexpr const char* kFormatBefore = "anchorsplat training 1";  // without checksum; still readable

Status ReadTensor(const TensorFile& file, const std::string& name, torch::Tensor tensor) {
  const torch::NoGradGuard no_gradient;
  const std::vector<int64_t> shape = tensor.sizes().vec();
  if (tensor.is_floating_point()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values values, file.ReadFloat32(name, shape));
    tensor.copy_(torch::from_blob(const_cast<float*>(values.values().data()), shape, torch::kFloat32));
    return {};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* entry, file.Require(name, shape));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Buffer<int64_t> values, CopyInt64(*entry));
  tensor.copy_(torch::from_blob(values.data(), shape, torch::kInt64));
  return {};
}

Status Compare(const std::string& file, const char* what, const std::string& theirs, const std::string& ours) {
  if (theirs == ours) return {};
  const auto a = nlohmann::json::parse(theirs, nullptr, false), b = nlohmann::json::parse(ours, nullptr, false);
  if (a.is_object() && b.is_object()) {
    nlohmann::json both = a;
    both.update(b);
    for (const auto& [key, unused] : both.items()) {
      const std::string then = a.contains(key) ? a[key].dump() : "missing",
                        now = b.contains(key) ? b[key].dump() : "missing";
      if (then == now) continue;
      return Error{ErrorCode::kBadArgument, Cat(file, ": is a checkpoint of another training: its ", key, " is ",
                                                Printable(then), ", this one's ", Printable(now))};
    }
  }
  if (a.is_array() && b.is_array()) {
    return Error{ErrorCode::kBadArgument, Cat(file, ": is a checkpoint of a training on other ", what, ": ", a.size(),
                                              " then, ", b.size(), " now")};
  }
  return Error{ErrorCode::kBadArgument, Cat(file, ": is a checkpoint of another training")};
}

Result<TensorFile> OpenCheckpoint(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(TensorFile file, TensorFile::Open(path));
  const auto format = file.metadata().find("format");
  if (format == file.metadata().end() || (format->second != kFormat && format->second != kFormatBefore)) {
    return Error{ErrorCode::kBadFile, Cat(path.string(), ": is not a checkpoint of a training (metadata \"format\")")};
  }
  if (format->second == kFormat) ANCHORSPLAT_RETURN_IF_ERROR(VerifyChecksum(file));
  return file;
}

}  // namespace

Status WriteTrainCheckpoint(const std::filesystem::path& path, const Optimizer& optimizer, const TrainProgress& p) {
  std::vector<torch::Tensor> kept;  // host copies, kept until written
  std::vector<TensorEntry> entries;
  for (const auto& [name, tensor] : optimizer.State()) {
    const bool real = tensor.is_floating_point();
    kept.push_back(tensor.to(torch::kCPU, real ? torch::kFloat32 : torch::kInt64).contiguous());
    const auto size = static_cast<size_t>(tensor.numel());
    entries.push_back(
        real ? MakeEntry(name, tensor.sizes().vec(), std::span(kept.back().const_data_ptr<float>(), size))
             : MakeEntry(name, tensor.sizes().vec(), std::span(kept.back().const_data_ptr<int64_t>(), size)));
  }
  const nlohmann::json progress = {
      {"step", p.step},          {"optimizer_steps", p.optimizer_steps}, {"skipped", p.skipped},
      {"seconds", p.seconds},    {"loss_scale", p.loss_scale},           {"since_scaled", p.since_scaled},
      {"best_psnr", p.best_psnr}};
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const auto metadata,
      WithChecksum(
          {{"format", kFormat}, {"progress", progress.dump()}, {"settings", p.settings}, {"objects", p.objects}},
          entries));
  return WriteSafetensors(path, entries, metadata, {.overwrite = true});
}

Result<TrainProgress> ReadTrainCheckpoint(const std::filesystem::path& path, const TrainProgress& expected,
                                          Optimizer& optimizer) {
  RecordOwnFile(path);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, OpenCheckpoint(path));
  const auto text = [&](const char* key) {
    const auto found = file.metadata().find(key);
    return found == file.metadata().end() ? std::string() : found->second;
  };
  ANCHORSPLAT_RETURN_IF_ERROR(Compare(path.string(), "settings", text("settings"), expected.settings));
  ANCHORSPLAT_RETURN_IF_ERROR(Compare(path.string(), "objects", text("objects"), expected.objects));
  TrainProgress p = expected;
  try {
    const nlohmann::json json = nlohmann::json::parse(text("progress"));
    p.step = json.at("step").get<int64_t>();
    p.optimizer_steps = json.at("optimizer_steps").get<int64_t>();
    p.skipped = json.at("skipped").get<int64_t>();
    p.seconds = json.at("seconds").get<double>();
    p.loss_scale = json.at("loss_scale").get<double>();
    p.since_scaled = json.at("since_scaled").get<int64_t>();
    p.best_psnr = json.at("best_psnr").get<double>();
  } catch (const nlohmann::json::exception&) {
    return Error{ErrorCode::kBadFile, Cat(path.string(), ": its metadata \"progress\" is not that of a training")};
  }
  if (p.step < 0 || p.optimizer_steps < 0 || p.optimizer_steps > p.step || !(p.loss_scale > 0)) {
    return Error{ErrorCode::kBadFile, Cat(path.string(), ": its metadata \"progress\" has impossible numbers")};
  }
  for (const auto& [name, tensor] : optimizer.State()) {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadTensor(file, name, tensor));
  }
  optimizer.set_steps(p.optimizer_steps);
  return p;
}

Status StartFromCheckpoint(const std::filesystem::path& path, Optimizer& optimizer) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, OpenCheckpoint(path));
  const std::string average = "average.", weights = "weights.";
  for (const auto& [name, tensor] : optimizer.State()) {
    if (name.starts_with(average)) {
      ANCHORSPLAT_RETURN_IF_ERROR(ReadTensor(file, name, tensor));
    } else if (name.starts_with(weights)) {
      ANCHORSPLAT_RETURN_IF_ERROR(ReadTensor(file, average + name.substr(weights.size()), tensor));
    }
  }
  return {};
}

}  // namespace anchorsplat

#include "compact/torch/compact_module.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "compact/compact_features.h"
#include "compact/compact_network.h"
#include "compact/compact_residual.h"
#include "compact/torch/compact_tables.h"
#include "compact/torch/edge_messages.h"
#include "core/text.h"
#include "enhance/filter.h"
#include "kernels/layer_norm.h"
#include "network/torch/group.h"
#include "render/constants.h"
#include "tensors/safetensors.h"

namespace anchorsplat {

namespace {

using torch::Tensor;

constexpr float kNoLimit = 1e30f;

Tensor FromBuffer(const Buffer<float>& values, std::vector<int64_t> shape) {
  return torch::from_blob(const_cast<float*>(values.data()), shape, torch::kFloat32).clone();
}

Tensor Bounded(const CompactAttribute& attribute, const Tensor& y) {
  return attribute.bound * torch::tanh(y * (attribute.gain / attribute.bound));
}

torch::nn::Linear LinearWithoutBias(int64_t inputs, int64_t outputs) {
  return torch::nn::Linear(torch::nn::LinearOptions(inputs, outputs).bias(false));
}

torch::nn::LayerNorm CompactLayerNorm(int64_t channels) {
  return torch::nn::LayerNorm(torch::nn::LayerNormOptions({channels}).eps(kLayerNormEpsilon));
}

// Quaternion product a ⊗ b, with a = (1, `vector`) [K,N,·] and b = `q` [N,4].
Tensor Turn(const Tensor& vector, const Tensor& q) {
  const Tensor x = vector.select(2, 0), y = vector.select(2, 1), z = vector.select(2, 2);
  const Tensor w = q.select(1, 0), a = q.select(1, 1), b = q.select(1, 2), c = q.select(1, 3);
  const Tensor product = torch::stack(
      {w - x * a - y * b - z * c, a + x * w + y * c - z * b, b - x * c + y * w + z * a, c + x * b - y * a + z * w}, 2);
  return product * torch::rsqrt(1 + vector.square().sum(2, true));
}

}  // namespace

CompactTrainable::CompactTrainable(const CompactConfig& config)
    : config_(config), start_(config.copies, config.spread) {
  const int64_t h = config.hidden, g = config.head_hidden;
  Group embed, rounds, head, out, domain;
  register_module("embed", embed);
  register_module("rounds", rounds);
  register_module("head", head);
  register_module("out", out);
  register_module("domain", domain);
  embed_first_ = embed->register_module("first", torch::nn::Linear(NodeFeatures(config), h));
  embed_second_ = embed->register_module("second", torch::nn::Linear(h, h));
  embed_norm_ = embed->register_module("norm", CompactLayerNorm(h));
  for (int64_t r = 0; r < config.rounds; ++r) {
    Group group;
    rounds->register_module(Cat(r), group);
    Round& round = rounds_.emplace_back();
    round.own = group->register_module("own", torch::nn::Linear(h, h));
    round.other = group->register_module("other", LinearWithoutBias(h, h));
    round.edge = group->register_module("edge", LinearWithoutBias(kEdgeFeatures, h));
    round.message = group->register_module("message", torch::nn::Linear(h, h));
    round.update_first = group->register_module("update_first", torch::nn::Linear(3 * h, h));
    round.update_second = group->register_module("update_second", torch::nn::Linear(h, h));
    round.norm = group->register_module("norm", CompactLayerNorm(h));
  }
  head_first_ = head->register_module("first", torch::nn::Linear(h + NodeFeatures(config), g));
  head_second_ = head->register_module("second", torch::nn::Linear(g, g));
  out_strength_ = out->register_module(kStrengthAttribute.name, torch::nn::Linear(g, 1));
  for (const CompactAttribute& attribute : CopyAttributes(config)) {
    out_.push_back(out->register_module(attribute.name, torch::nn::Linear(g, config.copies * attribute.channels)));
  }
  // Training starts from the filter's output.
  const torch::NoGradGuard no_gradient;
  for (Tensor& parameter : out->parameters()) parameter.zero_();
  low_ = domain->register_buffer("low", torch::full({NodeFeatures(config)}, kNoLimit));
  high_ = domain->register_buffer("high", torch::full({NodeFeatures(config)}, -kNoLimit));
}

Result<std::shared_ptr<void>> CompactTrainable::Prepare(const NetworkInput& input) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(auto tables, MakeCompactTables(config_, start_, input));
  return std::static_pointer_cast<void>(std::move(tables));
}

Result<std::shared_ptr<const void>> CompactTrainable::Survey(const NetworkInput& whole) {
  return SurveySplat(config_, whole);
}

SplatPart CompactTrainable::PartOf(const std::shared_ptr<const void>& survey, std::span<const int64_t> wanted) {
  return PartOfSplat(config_, survey, wanted);
}

Tensor CompactTrainable::Outputs(const NetworkInput& input) {
  const CompactTables& tables = *std::static_pointer_cast<CompactTables>(input.prepared);
  const int64_t n = tables.rings[0];
  Tensor state = embed_norm_(embed_second_(torch::gelu(embed_first_(tables.nodes))));
  for (size_t r = 0; r < rounds_.size(); ++r) {
    Round& round = rounds_[r];
    const EdgeIndex& index = tables.rounds[r];
    const int64_t left = tables.rings[rounds_.size() - 1 - r];
    const Tensor own = state.narrow(0, 0, left), edges = tables.edges.narrow(0, 0, left * index.neighbours);
    const Tensor pooled = PooledMessages(round.own(own), round.other(state), edges, index, round.edge->weight,
                                         round.message->weight, round.message->bias);
    const Tensor update = round.update_second(torch::gelu(round.update_first(torch::cat({own, pooled}, 1))));
    state = round.norm(own + update);
  }
  const Tensor told = tables.nodes.narrow(0, 0, n);
  const Tensor hidden = torch::gelu(head_second_(torch::gelu(head_first_(torch::cat({state, told}, 1)))));
  std::vector<Tensor> of_copies;
  const auto attributes = CopyAttributes(config_);
  for (size_t a = 0; a < out_.size(); ++a) {
    of_copies.push_back(out_[a](hidden).view({n, config_.copies, attributes[a].channels}));
  }
  return torch::cat({out_strength_(hidden), torch::cat(of_copies, 2).flatten(1)}, 1);
}

void CompactTrainable::ShareMemory(const std::function<void(Tensor&)>& maximum) {
  const torch::NoGradGuard no_gradient;
  Tensor reach = torch::cat({-low_, high_});
  maximum(reach);
  const int64_t told = NodeFeatures(config_);
  low_.copy_(-reach.narrow(0, 0, told));
  high_.copy_(reach.narrow(0, told, told));
}

GaussianTensors CompactTrainable::Forward(const NetworkInput& input) {
  const CompactTables& tables = *std::static_pointer_cast<CompactTables>(input.prepared);
  if (is_training()) {
    const torch::NoGradGuard no_gradient;
    low_.copy_(torch::minimum(low_, tables.range.low.to(low_.device())));
    high_.copy_(torch::maximum(high_, tables.range.high.to(high_.device())));
  }
  const int64_t n = tables.rings[0], copies = config_.copies, per_copy = ChannelsPerCopy(config_);
  const Tensor raw = Outputs(input).to(torch::kFloat32);

  Tensor log_scale = tables.log_scales;
  if (config_.prior) {
    const Tensor f = StrengthOf(input) + Bounded(kStrengthAttribute, raw.narrow(1, 0, 1));
    const Tensor gain = (f - ShownStrength(input.upscale, input.mode)).clamp_min(kLeastGain);
    log_scale = 0.5 * torch::logaddexp(2 * log_scale, torch::log(kDilation * gain) + 2 * tables.log_pixel);
  }
  const Tensor scale = log_scale.exp();
  const Tensor unit =
      config_.epsilon * (config_.offset_unit == OffsetUnit::kScale   ? scale
                         : config_.offset_unit == OffsetUnit::kPixel ? tables.log_pixel.exp()
                                                                     : torch::full_like(scale, tables.offset_side));
  // Frame to world coordinates, [K,N,3].
  const auto to_world = [&](const Tensor& v) { return (v.unsqueeze(3) * tables.axes).sum(2); };

  // All copies at once, [K,N,·], in row order.
  const GaussianTensors& all = input.gaussians;
  const Tensor anchor_means = all.means.narrow(0, 0, n), anchor_sh = all.sh.narrow(0, 0, n);
  const int64_t coefficients = anchor_sh.size(1);
  const Tensor y = raw.narrow(1, 1, copies * per_copy).view({n, copies, per_copy}).transpose(0, 1);
  int64_t column = 0;
  const auto next = [&](size_t attribute) {
    const int64_t channels = kCopyAttributes[attribute].channels;
    column += channels;
    return y.narrow(2, column - channels, channels);
  };
  const auto bounded = [&](size_t attribute) { return Bounded(kCopyAttributes[attribute], next(attribute)); };

  const Tensor moved = config_.anchors ? bounded(0) : next(0);
  std::vector<double> places;
  for (int64_t k = 0; k < copies; ++k) places.insert(places.end(), {start_.offset(k)[0], start_.offset(k)[1], 0.0});
  const Tensor begin = scale * torch::tensor(places, scale.options()).view({copies, 1, 3});
  const Tensor means = anchor_means + to_world(begin + unit * moved);
  const Tensor sized = log_scale + tables.log_shorter + bounded(1);
  const Tensor log_scales = torch::zeros_like(sized).scatter(2, tables.stored_axis.expand({copies, n, 3}), sized);
  const Tensor quats = Turn(0.5 * to_world(tables.handedness * bounded(2)), tables.quats);
  const Tensor logits = tables.start_logit + bounded(3).squeeze(2);
  std::vector<Tensor> degrees = {anchor_sh.narrow(1, 0, 1) + bounded(4).unsqueeze(2)};
  if (!config_.sh) {
    degrees.push_back(anchor_sh.narrow(1, 1, coefficients - 1).expand({copies, n, coefficients - 1, 3}));
  } else {
    const Tensor factors = 1 + bounded(5);
    const Tensor linear = bounded(6).reshape({copies, n, 3, 3});  // axis, colour
    for (int64_t degree = 1, first = 1; first < coefficients; ++degree, first = degree * degree) {
      Tensor values =
          anchor_sh.narrow(1, first, 2 * degree + 1) * factors.select(2, degree - 1).view({copies, n, 1, 1});
      if (degree == 1) {
        const Tensor world = tables.axes.transpose(1, 2).matmul(linear);  // x, y or z; colour
        // The basis is (−y, z, −x), see ShBasis.
        values = values + torch::stack({-world.select(2, 1), world.select(2, 2), -world.select(2, 0)}, 2);
      }
      degrees.push_back(values);
    }
  }
  const Tensor sh = torch::cat(degrees, 2);
  return {means.flatten(0, 1), log_scales.flatten(0, 1), quats.flatten(0, 1), logits.flatten(0, 1), sh.flatten(0, 1)};
}

std::vector<std::pair<std::string, std::vector<Tensor>>> CompactTrainable::Groups() {
  std::vector<std::pair<std::string, std::vector<Tensor>>> groups = {{"backbone", {}}, {"head", {}}};
  for (const auto& item : named_parameters()) {
    const std::string& name = item.key();
    if (name.starts_with("out.")) {
      const std::string attribute = name.substr(4, name.find('.', 4) - 4);
      if (groups.back().first != attribute) groups.push_back({attribute, {}});
      groups.back().second.push_back(item.value());
    } else {
      groups[name.starts_with("head.") ? 1 : 0].second.push_back(item.value());
    }
  }
  return groups;
}

Status CompactTrainable::SetWeights(const WeightSource& source) {
  const torch::NoGradGuard no_gradient;
  auto state = named_parameters();
  for (const auto& item : named_buffers()) state.insert(item.key(), item.value());
  for (const TensorSpec& spec : CompactTensors(config_)) {
    const Tensor values = torch::empty(spec.shape, torch::kFloat32);
    ANCHORSPLAT_RETURN_IF_ERROR(source(spec, {values.data_ptr<float>(), static_cast<size_t>(values.numel())}));
    state[spec.name].copy_(values);
  }
  return {};
}

WeightSource CompactTrainable::Weights() {
  std::map<std::string, Tensor> state;
  for (const auto& item : named_parameters()) state.emplace(item.key(), item.value());
  for (const auto& item : named_buffers()) state.emplace(item.key(), item.value());
  return [state = std::move(state)](const TensorSpec& tensor, std::span<float> values) -> Status {
    const Tensor own = state.at(tensor.name).detach().to(torch::kCPU, torch::kFloat32).contiguous();
    std::copy_n(own.const_data_ptr<float>(), values.size(), values.begin());
    return {};
  };
}

Status CompactTrainable::Save(const std::filesystem::path& path, const std::map<std::string, std::string>& metadata) {
  const WeightSource source = Weights();
  std::vector<std::vector<float>> values;
  std::vector<TensorEntry> entries;
  const auto tensors = CompactTensors(config_);
  values.reserve(tensors.size());
  for (const TensorSpec& spec : tensors) {
    int64_t count = 1;
    for (const int64_t side : spec.shape) count *= side;
    std::vector<float>& array = values.emplace_back(static_cast<size_t>(count));
    ANCHORSPLAT_RETURN_IF_ERROR(source(spec, array));
    entries.push_back(MakeEntry(spec.name, spec.shape, array));
  }
  std::map<std::string, std::string> all = metadata;
  for (const auto& [key, value] : ToMetadata(config_)) all[key] = value;
  return WriteSafetensors(path, entries, all, {.overwrite = true});
}

Status CompactTrainable::InitialiseFrom(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
  if (!IsCompactNetwork(file)) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": expected a compact network's weights")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(CompactConfig config, CompactConfigFromMetadata(file.metadata()));
  const torch::NoGradGuard no_gradient;
  int64_t taken = 0;
  auto state = named_parameters();
  for (const auto& item : named_buffers()) state.insert(item.key(), item.value());
  for (auto& item : state) {
    const TensorEntry* entry = file.Find(item.key());
    if (entry == nullptr) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Buffer<float> values, CopyFloat32(*entry));
    Tensor given = FromBuffer(values, entry->shape);
    std::vector<int64_t> shape = item.value().sizes().vec();
    const bool of_copies = item.key().starts_with("out.") && !item.key().starts_with("out.strength");
    if (of_copies && given.size(0) % config.copies == 0 && config.copies != config_.copies) {
      const int64_t channels = given.size(0) / config.copies;
      std::vector<int64_t> times(shape.size(), 1);
      times[0] = config_.copies;
      given = given.narrow(0, 0, channels).repeat(times);
    }
    const bool reads_nodes = item.key() == "embed.first.weight" || item.key() == "head.first.weight";
    const int64_t unheard = NodeFeatures(config_) - NodeFeatures(config);
    if (reads_nodes && unheard > 0) given = torch::constant_pad_nd(given, {0, unheard});
    // New features have no known range yet.
    if (item.key() == "domain.low" && unheard > 0) given = torch::constant_pad_nd(given, {0, unheard}, kNoLimit);
    if (item.key() == "domain.high" && unheard > 0) given = torch::constant_pad_nd(given, {0, unheard}, -kNoLimit);
    if (given.sizes().vec() != shape) continue;
    item.value().copy_(given);
    ++taken;
  }
  if (taken == 0) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": none of its tensors has the shape of this network's")};
  }
  return {};
}

}  // namespace anchorsplat

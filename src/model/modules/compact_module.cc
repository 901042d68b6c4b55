#include "model/modules/compact_module.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "core/text.h"
#include "enhance/filter.h"
#include "formats/safetensors.h"
#include "model/compact_features.h"
#include "model/compact_graph.h"
#include "model/compact_network.h"
#include "model/compact_residual.h"
#include "model/modules/edge_messages.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

using torch::Tensor;

// Gives parameters their names.
class GroupImpl : public torch::nn::Module {};
TORCH_MODULE(Group);

constexpr double kDomainQuantile = 0.005;
constexpr float kNoLimit = 1e30f;

// What Prepare makes of a splat.
struct Prepared {
  Tensor nodes;  // [N,kNodeFeatures]
  Tensor edges;  // [N·m,kEdgeFeatures]
  EdgeIndex index;
  Tensor axes;         // [N,3,3] axis a is row a
  Tensor handedness;   // [N,1] ±1
  Tensor stored_axis;  // [N,3] int64
  Tensor log_scales;   // [N,3] longest first
  Tensor quats;        // [N,4] unit
  Tensor log_pixel;    // [N,1]
  Tensor start_logit;  // [N]
  Tensor log_shorter;  // [N,3] longest first
  Tensor low, high;    // [kNodeFeatures] quantiles of the nodes
  double offset_side = 0;
};

Tensor FromBuffer(const Buffer<float>& values, std::vector<int64_t> shape) {
  return torch::from_blob(const_cast<float*>(values.data()), shape, torch::kFloat32).clone();
}

void CopyTo(const Tensor& tensor, Buffer<float>& out) {
  const Tensor own = tensor.detach().to(torch::kCPU, torch::kFloat32).contiguous();
  out.assign(own.const_data_ptr<float>(), own.const_data_ptr<float>() + own.numel());
}

Tensor Bounded(const CompactAttribute& attribute, const Tensor& y) {
  return attribute.bound * torch::tanh(y * (attribute.gain / attribute.bound));
}

torch::nn::Linear LinearWithoutBias(int64_t inputs, int64_t outputs) {
  return torch::nn::Linear(torch::nn::LinearOptions(inputs, outputs).bias(false));
}

torch::nn::LayerNorm LayerNormOf(int64_t channels) {
  return torch::nn::LayerNorm(torch::nn::LayerNormOptions({channels}).eps(kLayerNormEpsilon));
}

// a ⊗ b of quaternions [N,4]; a's first component is 1.
Tensor Turn(const Tensor& vector, const Tensor& q) {
  const Tensor x = vector.select(1, 0), y = vector.select(1, 1), z = vector.select(1, 2);
  const Tensor w = q.select(1, 0), a = q.select(1, 1), b = q.select(1, 2), c = q.select(1, 3);
  const Tensor product = torch::stack(
      {w - x * a - y * b - z * c, a + x * w + y * c - z * b, b - x * c + y * w + z * a, c + x * b - y * a + z * w}, 1);
  return product * torch::rsqrt(1 + vector.square().sum(1, true));
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
  embed_first_ = embed->register_module("first", torch::nn::Linear(kNodeFeatures, h));
  embed_second_ = embed->register_module("second", torch::nn::Linear(h, h));
  embed_norm_ = embed->register_module("norm", LayerNormOf(h));
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
    round.norm = group->register_module("norm", LayerNormOf(h));
  }
  head_first_ = head->register_module("first", torch::nn::Linear(h + kNodeFeatures, g));
  head_second_ = head->register_module("second", torch::nn::Linear(g, g));
  out_strength_ = out->register_module(kStrengthAttribute.name, torch::nn::Linear(g, 1));
  for (const CompactAttribute& attribute : CopyAttributes(config)) {
    out_.push_back(out->register_module(attribute.name, torch::nn::Linear(g, config.copies * attribute.channels)));
  }
  // Training begins at the filter.
  const torch::NoGradGuard no_gradient;
  for (Tensor& parameter : out->parameters()) parameter.zero_();
  low_ = domain->register_buffer("low", torch::full({kNodeFeatures}, kNoLimit));
  high_ = domain->register_buffer("high", torch::full({kNodeFeatures}, -kNoLimit));
}

Result<std::shared_ptr<void>> CompactTrainable::Prepare(const NetworkInput& input) {
  const torch::NoGradGuard no_gradient;
  const GaussianCloud cloud = ToCloud(input.gaussians);
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  const int64_t n = cloud.size();
  if (n == 0) return Error{ErrorCode::kBadArgument, "the splat has no Gaussians"};
  for (int64_t i = 0; i < n; ++i) {
    if (!IsUsable(cloud, i))
      return Error{ErrorCode::kBadArgument, Cat("Gaussian ", i, " has values that are not finite")};
  }
  Buffer<float> pixel_sizes;
  CopyTo(input.pixel_sizes.expand({n}), pixel_sizes);
  if (!std::all_of(pixel_sizes.begin(), pixel_sizes.end(), [](float p) { return p > 0 && std::isfinite(p); })) {
    return Error{ErrorCode::kBadArgument, "a pixel size is not a positive length"};
  }
  const CompactGraph graph = BuildCompactGraph(cloud, config_.neighbours, config_.context);
  const CompactFeatures features(cloud, graph, pixel_sizes, input.upscale);

  const auto prepared = std::make_shared<Prepared>();
  prepared->nodes = torch::empty({n, kNodeFeatures});
  prepared->edges = torch::empty({n * graph.neighbours, kEdgeFeatures});
  features.Nodes(0, n, prepared->nodes.data_ptr<float>());
  features.Edges(0, n, prepared->edges.data_ptr<float>());
  prepared->index = MakeEdgeIndex(
      torch::from_blob(const_cast<int32_t*>(graph.index.data()), {n * graph.neighbours}, torch::kInt32), n);
  prepared->axes = FromBuffer(graph.axes, {n, 3, 3});
  prepared->handedness = torch::linalg_det(prepared->axes).sign().unsqueeze(1);
  prepared->stored_axis =
      torch::from_blob(const_cast<uint8_t*>(graph.stored_axis.data()), {n, 3}, torch::kUInt8).to(torch::kInt64);
  prepared->log_scales = FromBuffer(cloud.log_scales, {n, 3}).gather(1, prepared->stored_axis);
  const Tensor quats = FromBuffer(cloud.quats, {n, 4}).to(torch::kFloat64), norms = quats.norm(2, 1, true);
  const Tensor identity = torch::tensor({1.0, 0.0, 0.0, 0.0}, torch::kFloat64).expand({n, 4});
  prepared->quats = torch::where(norms > 0, quats / norms.clamp_min(1e-300), identity).to(torch::kFloat32);
  prepared->log_pixel = FromBuffer(pixel_sizes, {n, 1}).log();
  Buffer<float> logits(static_cast<size_t>(n)), shorter(static_cast<size_t>(3 * n));
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    const CopyStart::Shape shape = start_.ShapeOf(cloud.opacity_logits[i]);
    logits[i] = static_cast<float>(shape.opacity_logit);
    for (size_t a = 0; a < 3; ++a) shorter[3 * i + a] = static_cast<float>(shape.log_shorter[a]);
  }
  prepared->start_logit = FromBuffer(logits, {n});
  prepared->log_shorter = FromBuffer(shorter, {n, 3});
  const Tensor sorted = std::get<0>(prepared->nodes.sort(0));
  const auto rank = static_cast<int64_t>(kDomainQuantile * static_cast<double>(n - 1));
  prepared->low = sorted[rank].clone();
  prepared->high = sorted[n - 1 - rank].clone();
  if (config_.offset_unit == OffsetUnit::kCube) prepared->offset_side = CubeSide(cloud.means);

  for (Tensor* tensor :
       {&prepared->nodes, &prepared->edges, &prepared->index.index, &prepared->axes, &prepared->handedness,
        &prepared->stored_axis, &prepared->log_scales, &prepared->quats, &prepared->log_pixel, &prepared->start_logit,
        &prepared->log_shorter, &prepared->low, &prepared->high}) {
    *tensor = tensor->to(input.gaussians.means.device());
  }
  return std::static_pointer_cast<void>(prepared);
}

Tensor CompactTrainable::Outputs(const NetworkInput& input) {
  const Prepared& prepared = *std::static_pointer_cast<Prepared>(input.prepared);
  const int64_t n = prepared.nodes.size(0);
  Tensor state = embed_norm_(embed_second_(torch::gelu(embed_first_(prepared.nodes))));
  for (Round& round : rounds_) {
    const Tensor pooled = PooledMessages(round.own(state), round.other(state), prepared.edges, prepared.index,
                                         round.edge->weight, round.message->weight, round.message->bias);
    const Tensor update = round.update_second(torch::gelu(round.update_first(torch::cat({state, pooled}, 1))));
    state = round.norm(state + update);
  }
  const Tensor hidden = torch::gelu(head_second_(torch::gelu(head_first_(torch::cat({state, prepared.nodes}, 1)))));
  std::vector<Tensor> of_copies;
  const auto attributes = CopyAttributes(config_);
  for (size_t a = 0; a < out_.size(); ++a) {
    of_copies.push_back(out_[a](hidden).view({n, config_.copies, attributes[a].channels}));
  }
  return torch::cat({out_strength_(hidden), torch::cat(of_copies, 2).flatten(1)}, 1);
}

GaussianTensors CompactTrainable::Forward(const NetworkInput& input) {
  const Prepared& prepared = *std::static_pointer_cast<Prepared>(input.prepared);
  if (is_training()) {
    const torch::NoGradGuard no_gradient;
    low_.copy_(torch::minimum(low_, prepared.low.to(low_.device())));
    high_.copy_(torch::maximum(high_, prepared.high.to(high_.device())));
  }
  const int64_t n = prepared.nodes.size(0), copies = config_.copies, per_copy = ChannelsPerCopy(config_);
  const Tensor raw = Outputs(input).to(torch::kFloat32);

  Tensor log_scale = prepared.log_scales;
  if (config_.prior) {
    const Tensor f = DefaultFilterStrength(input.upscale) + Bounded(kStrengthAttribute, raw.narrow(1, 0, 1));
    const Tensor gain = (f - 1 / (input.upscale * input.upscale)).clamp_min(kLeastGain);
    log_scale = 0.5 * torch::logaddexp(2 * log_scale, torch::log(kDilation * gain) + 2 * prepared.log_pixel);
  }
  const Tensor scale = log_scale.exp();
  const Tensor unit =
      config_.epsilon * (config_.offset_unit == OffsetUnit::kScale   ? scale
                         : config_.offset_unit == OffsetUnit::kPixel ? prepared.log_pixel.exp()
                                                                     : torch::full_like(scale, prepared.offset_side));
  const auto to_world = [&](const Tensor& v) { return (v.unsqueeze(2) * prepared.axes).sum(1); };  // [N,3] → [N,3]

  const GaussianTensors& g = input.gaussians;
  const int64_t coefficients = g.sh.size(1);
  const Tensor y = raw.narrow(1, 1, copies * per_copy).view({n, copies, per_copy});
  std::vector<Tensor> means, log_scales, quats, logits, sh;
  for (int64_t k = 0; k < copies; ++k) {
    int64_t column = 0;
    const auto next = [&](size_t attribute) {
      const int64_t channels = kCopyAttributes[attribute].channels;
      column += channels;
      return y.select(1, k).narrow(1, column - channels, channels);
    };
    const Tensor moved = next(0);
    const auto& place = start_.offset(k);
    const Tensor begin = scale * torch::tensor({place[0], place[1], 0.0}, scale.options());
    means.push_back(g.means + to_world(begin + unit * (config_.anchors ? Bounded(kCopyAttributes[0], moved) : moved)));
    const Tensor sized = log_scale + prepared.log_shorter + Bounded(kCopyAttributes[1], next(1));
    log_scales.push_back(torch::zeros_like(sized).scatter(1, prepared.stored_axis, sized));
    const Tensor turn = prepared.handedness * Bounded(kCopyAttributes[2], next(2));
    quats.push_back(Turn(0.5 * to_world(turn), prepared.quats));
    logits.push_back(prepared.start_logit + Bounded(kCopyAttributes[3], next(3)).squeeze(1));
    std::vector<Tensor> degrees;
    degrees.push_back(g.sh.narrow(1, 0, 1) + Bounded(kCopyAttributes[4], next(4)).unsqueeze(1));
    if (!config_.sh) {
      degrees.push_back(g.sh.narrow(1, 1, coefficients - 1));
    } else {
      const Tensor factors = 1 + Bounded(kCopyAttributes[5], next(5));
      const Tensor linear = Bounded(kCopyAttributes[6], next(6)).view({n, 3, 3});  // axis, colour
      for (int64_t degree = 1, first = 1; first < coefficients; ++degree, first = degree * degree) {
        Tensor values = g.sh.narrow(1, first, 2 * degree + 1) * factors.select(1, degree - 1).view({n, 1, 1});
        if (degree == 1) {
          const Tensor world = prepared.axes.transpose(1, 2).matmul(linear);  // x, y or z; colour
          // The basis is (−y, z, −x), see ShBasis.
          values = values + torch::stack({-world.select(1, 1), world.select(1, 2), -world.select(1, 0)}, 1);
        }
        degrees.push_back(values);
      }
    }
    sh.push_back(torch::cat(degrees, 1));
  }
  return {torch::cat(means), torch::cat(log_scales), torch::cat(quats), torch::cat(logits), torch::cat(sh)};
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
    if (given.sizes().vec() != shape) continue;
    item.value().copy_(given);
    ++taken;
  }
  if (taken == 0) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": none of its tensors has the shape of this network's")};
  }
  return {};
}

// Options are those of VisitCompactOptions, and `init`: a file for InitialiseFrom.
Result<std::shared_ptr<TrainableNetwork>> MakeCompactTrainable(NetworkOptions options) {
  std::string init;
  if (const auto given = options.find("init"); given != options.end()) {
    const std::string* path = std::get_if<std::string>(&given->second);
    if (path == nullptr)
      return Error{ErrorCode::kBadArgument, "init: expected the path of a compact network's weights"};
    init = *path;
    options.erase(given);
  }
  CompactConfig config;
  OptionReader reader(std::move(options));
  VisitCompactOptions(config, reader);
  ANCHORSPLAT_RETURN_IF_ERROR(reader.Finish());
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(config));
  const auto network = std::make_shared<CompactTrainable>(config);
  if (!init.empty()) ANCHORSPLAT_RETURN_IF_ERROR(network->InitialiseFrom(init));
  return std::static_pointer_cast<TrainableNetwork>(network);
}

}  // namespace anchorsplat

#include "compact/torch/compact_tables.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "compact/compact_features.h"
#include "compact/compact_graph.h"
#include "compact/compact_residual.h"
#include "core/text.h"
#include "enhance/filter.h"

namespace anchorsplat {

namespace {

using torch::Tensor;

constexpr double kDomainQuantile = 0.005;

FeatureRange RangeOf(const Tensor& nodes) {
  const int64_t n = nodes.size(0);
  const Tensor sorted = std::get<0>(nodes.sort(0));
  const auto rank = static_cast<int64_t>(kDomainQuantile * static_cast<double>(n - 1));
  return {sorted[rank].clone(), sorted[n - 1 - rank].clone()};
}

// Result of Survey: the whole splat's neighbours.
struct Surveyed {
  int64_t neighbours = 0;  // m
  Buffer<int32_t> index;   // [N,m]
  FeatureRange range;
};

// Tables of a part. Its rows form rings: the wanted ones, their neighbours, those neighbours' neighbours, …
struct PartTables {
  std::vector<int64_t> rings;  // number of rows up to the end of each ring; rounds + 2 entries
  int64_t neighbours = 0;      // m
  Buffer<int32_t> index;       // [rows,m] neighbours as rows of the part; rows of the last ring refer to themselves
  FeatureRange range;
};

Tensor TensorFromBuffer(const Buffer<float>& values, std::vector<int64_t> shape) {
  return torch::from_blob(const_cast<float*>(values.data()), shape, torch::kFloat32).clone();
}

void CopyTo(const Tensor& tensor, Buffer<float>& out) {
  const Tensor own = tensor.detach().to(torch::kCPU, torch::kFloat32).contiguous();
  out.assign(own.const_data_ptr<float>(), own.const_data_ptr<float>() + own.numel());
}

// A splat checked to be usable, with p_LR per Gaussian.
struct UsableSplat {
  GaussianCloud cloud;
  Buffer<float> pixel_sizes;
};

Result<UsableSplat> UsableSplatOf(const NetworkInput& input) {
  UsableSplat splat{ToCloud(input.gaussians), {}};
  splat.cloud.render_mode = input.mode;
  const GaussianCloud& cloud = splat.cloud;
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  const int64_t n = cloud.size();
  if (n == 0) return Error{ErrorCode::kBadArgument, "the splat has no Gaussians"};
  for (int64_t i = 0; i < n; ++i) {
    if (!IsUsable(cloud, i))
      return Error{ErrorCode::kBadArgument, Cat("Gaussian ", i, " has values that are not finite")};
  }
  CopyTo(input.pixel_sizes.expand({n}), splat.pixel_sizes);
  if (!std::all_of(splat.pixel_sizes.begin(), splat.pixel_sizes.end(),
                   [](float p) { return p > 0 && std::isfinite(p); })) {
    return Error{ErrorCode::kBadArgument, "a pixel size is not a positive length"};
  }
  return splat;
}

CompactFeatures::Task FeatureTask(const CompactConfig& config, const NetworkInput& input, const Buffer<float>& sizes) {
  return {.pixel_sizes = sizes,
          .upscale = input.upscale,
          .strength = StrengthOf(input),
          .node_features = NodeFeatures(config)};
}

// ±1: the determinant of each frame.
Tensor Handedness(const CompactGraph& graph, int64_t n) {
  Tensor signs = torch::empty({n, 1});
  float* sign = signs.data_ptr<float>();
  for (int64_t i = 0; i < n; ++i) {
    const float *a = graph.axis(i, 0), *b = graph.axis(i, 1), *c = graph.axis(i, 2);
    const float determinant =
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    sign[i] = determinant < 0 ? -1.0f : 1.0f;
  }
  return signs;
}

}  // namespace

double StrengthOf(const NetworkInput& input) {
  return input.strength.value_or(DefaultFilterStrength(input.upscale, input.mode));
}

Result<std::shared_ptr<const void>> SurveySplat(const CompactConfig& config, const NetworkInput& whole) {
  const torch::NoGradGuard no_gradient;
  if (config.offset_unit == OffsetUnit::kCube) {
    return Error{ErrorCode::kBadArgument, "offset_unit: \"cube\" is a length of the whole splat, so it has no parts"};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const UsableSplat splat, UsableSplatOf(whole));
  CompactGraph graph = BuildCompactGraph(splat.cloud, config.neighbours, config.context);
  const Tensor nodes = torch::empty({graph.count, NodeFeatures(config)});
  CompactFeatures(splat.cloud, graph, FeatureTask(config, whole, splat.pixel_sizes))
      .Nodes(0, graph.count, nodes.data_ptr<float>());
  const auto surveyed = std::make_shared<Surveyed>();
  surveyed->neighbours = graph.neighbours;
  surveyed->index = std::move(graph.index);
  surveyed->range = RangeOf(nodes);
  return std::static_pointer_cast<const void>(surveyed);
}

SplatPart PartOfSplat(const CompactConfig& config, const std::shared_ptr<const void>& survey,
                      std::span<const int64_t> wanted) {
  const auto& surveyed = *std::static_pointer_cast<const Surveyed>(survey);
  const int64_t m = surveyed.neighbours;
  const auto neighbour = [&](int64_t row, int64_t k) {
    return int64_t{surveyed.index[static_cast<size_t>(row * m + k)]};
  };
  const auto tables = std::make_shared<PartTables>();
  SplatPart part;
  part.rows.assign(wanted.begin(), wanted.end());
  part.wanted = static_cast<int64_t>(wanted.size());
  std::vector<int32_t> place(m > 0 ? surveyed.index.size() / static_cast<size_t>(m) : 1, -1);  // row in the part
  for (size_t i = 0; i < wanted.size(); ++i) place[static_cast<size_t>(wanted[i])] = static_cast<int32_t>(i);
  tables->rings.push_back(part.wanted);
  for (int64_t ring = 0, begin = 0; ring <= config.rounds; ++ring) {
    const auto end = static_cast<int64_t>(part.rows.size());
    for (int64_t i = begin; i < end; ++i) {
      for (int64_t k = 0; k < m; ++k) {
        const int64_t far = neighbour(part.rows[static_cast<size_t>(i)], k);
        if (place[static_cast<size_t>(far)] >= 0) continue;
        place[static_cast<size_t>(far)] = static_cast<int32_t>(part.rows.size());
        part.rows.push_back(far);
      }
    }
    begin = end;
    tables->rings.push_back(static_cast<int64_t>(part.rows.size()));
  }
  tables->neighbours = m;
  tables->index.resize(part.rows.size() * static_cast<size_t>(m));
  const int64_t known = tables->rings[static_cast<size_t>(config.rounds)];
  for (int64_t i = 0; i < tables->rings.back(); ++i) {
    for (int64_t k = 0; k < m; ++k) {
      tables->index[static_cast<size_t>(i * m + k)] =
          i < known ? place[static_cast<size_t>(neighbour(part.rows[static_cast<size_t>(i)], k))]
                    : static_cast<int32_t>(i);
    }
  }
  tables->range = surveyed.range;
  part.tables = tables;
  return part;
}

Result<std::shared_ptr<CompactTables>> MakeCompactTables(const CompactConfig& config, const CopyStart& start,
                                                         const NetworkInput& input) {
  const torch::NoGradGuard no_gradient;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const UsableSplat splat, UsableSplatOf(input));
  const GaussianCloud& cloud = splat.cloud;
  const auto made = std::make_shared<CompactTables>();
  const auto* tables = input.part ? static_cast<const PartTables*>(input.part->tables.get()) : nullptr;
  const CompactGraph graph = tables != nullptr ? GraphOfNeighbours(cloud, tables->neighbours, tables->index)
                                               : BuildCompactGraph(cloud, config.neighbours, config.context);
  const auto rounds = static_cast<size_t>(config.rounds);
  made->rings = tables != nullptr ? tables->rings : std::vector<int64_t>(rounds + 2, cloud.size());
  const int64_t n = made->rings[0], m = graph.neighbours;
  const CompactFeatures features(cloud, graph, FeatureTask(config, input, splat.pixel_sizes));
  made->nodes = torch::empty({made->rings[rounds], NodeFeatures(config)});
  features.Nodes(0, made->rings[rounds], made->nodes.data_ptr<float>());
  made->range = tables != nullptr ? tables->range : RangeOf(made->nodes);
  const int64_t readers = rounds > 0 ? made->rings[rounds - 1] : 0;
  made->edges = torch::empty({readers * m, kEdgeFeatures});
  features.Edges(0, readers, made->edges.data_ptr<float>());
  for (size_t r = 0; r < rounds; ++r) {
    const int64_t points = made->rings[rounds - 1 - r], others = made->rings[rounds - r];
    if (r > 0 && tables == nullptr) {
      made->rounds.push_back(made->rounds[0]);
      continue;
    }
    made->rounds.push_back(MakeEdgeIndex(
        torch::from_blob(const_cast<int32_t*>(graph.index.data()), {points * m}, torch::kInt32), points, others));
  }
  made->axes = TensorFromBuffer(graph.axes, {n, 3, 3});
  made->handedness = Handedness(graph, n);
  made->stored_axis =
      torch::from_blob(const_cast<uint8_t*>(graph.stored_axis.data()), {n, 3}, torch::kUInt8).to(torch::kInt64);
  made->log_scales = TensorFromBuffer(cloud.log_scales, {n, 3}).gather(1, made->stored_axis);
  const Tensor quats = TensorFromBuffer(cloud.quats, {n, 4}).to(torch::kFloat64), norms = quats.norm(2, 1, true);
  const Tensor identity = torch::tensor({1.0, 0.0, 0.0, 0.0}, torch::kFloat64).expand({n, 4});
  made->quats = torch::where(norms > 0, quats / norms.clamp_min(1e-300), identity).to(torch::kFloat32);
  made->log_pixel = TensorFromBuffer(splat.pixel_sizes, {n, 1}).log();
  Buffer<float> logits(static_cast<size_t>(n)), shorter(static_cast<size_t>(3 * n));
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    const CopyStart::Shape shape = start.ShapeOf(cloud.opacity_logits[i]);
    logits[i] = static_cast<float>(shape.opacity_logit);
    for (size_t a = 0; a < 3; ++a) shorter[3 * i + a] = static_cast<float>(shape.log_shorter[a]);
  }
  made->start_logit = TensorFromBuffer(logits, {n});
  made->log_shorter = TensorFromBuffer(shorter, {n, 3});
  if (config.offset_unit == OffsetUnit::kCube) made->offset_side = CubeSide(cloud.means);

  for (Tensor* tensor :
       {&made->nodes, &made->edges, &made->axes, &made->handedness, &made->stored_axis, &made->log_scales, &made->quats,
        &made->log_pixel, &made->start_logit, &made->log_shorter, &made->range.low, &made->range.high}) {
    *tensor = tensor->to(input.gaussians.means.device());
  }
  for (EdgeIndex& index : made->rounds) index.index = index.index.to(input.gaussians.means.device());
  return made;
}

}  // namespace anchorsplat

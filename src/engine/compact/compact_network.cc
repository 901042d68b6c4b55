#include "compact/compact_network.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <new>
#include <utility>

#include "compact/compact_checkpoint.h"
#include "compact/compact_start.h"
#include "core/finite.h"
#include "core/log.h"
#include "core/memory_limit.h"
#include "core/parallel.h"
#include "core/row_scatter.h"
#include "core/run_context.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "kernels/edge_messages.h"
#include "kernels/layer_norm.h"
#include "kernels/linear.h"

namespace anchorsplat {

namespace {

// Gaussians whose messages are computed at once: 8 neighbours × 64 channels are 256 KB and stay in the cache.
constexpr int64_t kRowsPerTask = 128;
constexpr int64_t kMostRows = int64_t{1} << 31;

}  // namespace

bool CompactNetwork::HasTrainingRange() const {
  for (size_t c = 0; c < low_.size(); ++c) {
    if (low_[c] > high_[c]) return false;
  }
  return true;
}

std::pair<double, double> CompactNetwork::TrainedUpscales() const {
  const auto upscale = [](float feature) { return std::exp2(2 * double{feature}); };
  return {upscale(low_[kUpscaleFeature]), upscale(high_[kUpscaleFeature])};
}

void CompactNetwork::FindStates(const CompactFeatures& features, const CompactBlock& block, int64_t m,
                                States& of_block) const {
  const int64_t n = block.reach.back(), h = config_.hidden;
  Buffer<float>&states = of_block.own, &others = of_block.others;
  states.resize(static_cast<size_t>(n * h));
  others.resize(rounds_.empty() ? 0 : static_cast<size_t>(n * h));
  const auto normalise = [&](int64_t rows, const Norm& norm, float* x) {
    LayerNormCpu({.rows = rows,
                  .channels = h,
                  .input = x,
                  .weight = norm.weight.data(),
                  .bias = norm.bias.data(),
                  .epsilon = static_cast<float>(kLayerNormEpsilon),
                  .out = x});
  };
  const auto rows_of = [&](int64_t begin, int64_t end) {
    return std::span(block.rows).subspan(static_cast<size_t>(begin), static_cast<size_t>(end - begin));
  };
  ParallelFor(0, n, kRowsPerTask, [&](int64_t begin, int64_t end) {
    const int64_t rows = end - begin;
    Buffer<float> nodes(static_cast<size_t>(rows * NodeFeatures(config_))), first(static_cast<size_t>(rows * h));
    features.Nodes(rows_of(begin, end), nodes.data());
    LinearCpu(rows, nodes.data(), embed_first_, first.data(), Activation::kGelu);
    LinearCpu(rows, first.data(), embed_second_, states.data() + begin * h);
    normalise(rows, embed_norm_, states.data() + begin * h);
  });
  for (size_t r = 0; r < rounds_.size(); ++r) {
    const Round& round = rounds_[r];
    // In each round only states that the block's own still depend on are updated.
    const int64_t listeners = block.reach[rounds_.size() - 1 - r], heard = block.reach[rounds_.size() - r];
    LinearCpu(heard, states.data(), round.other, others.data());
    ParallelFor(0, listeners, kRowsPerTask, [&](int64_t begin, int64_t end) {
      const int64_t rows = end - begin;
      float* own_states = states.data() + begin * h;
      Buffer<float> own(static_cast<size_t>(rows * h)),
          features_of_edges(static_cast<size_t>(rows * m * kEdgeFeatures)), edges(static_cast<size_t>(rows * m * h)),
          messages(edges.size()), pooled(static_cast<size_t>(rows * 3 * h));
      LinearCpu(rows, own_states, round.own, own.data());
      features.Edges(rows_of(begin, end), features_of_edges.data());
      LinearCpu(rows * m, features_of_edges.data(), round.edge, edges.data());
      EdgeSumGeluCpu({.points = rows,
                      .neighbours = m,
                      .channels = h,
                      .own = own.data(),
                      .other = others.data(),
                      .index = block.index.data() + begin * m,
                      .edges = edges.data()});
      LinearCpu(rows * m, edges.data(), round.message, messages.data());
      for (int64_t i = 0; i < rows; ++i) std::copy_n(own_states + i * h, h, pooled.data() + i * 3 * h);
      EdgePoolCpu({.points = rows,
                   .neighbours = m,
                   .channels = h,
                   .edges = messages.data(),
                   .out_stride = 3 * h,
                   .out = pooled.data() + h});
      LinearCpu(rows, pooled.data(), round.update_first, own.data(), Activation::kGelu);
      // In place: messages were computed from the old states before.
      LinearCpu(rows, own.data(), round.update_second, own_states, Activation::kNone, own_states);
      normalise(rows, round.norm, own_states);
    });
  }
}

void CompactNetwork::Head(const CompactFeatures& features, const CompactBlock& block, const States& states,
                          int64_t begin, int64_t end, float* out) const {
  const int64_t rows = end - begin, h = config_.hidden, told = NodeFeatures(config_), width = h + told,
                g = config_.head_hidden;
  Buffer<float> nodes(static_cast<size_t>(rows * told)), input(static_cast<size_t>(rows * width)),
      first(static_cast<size_t>(rows * g)), second(static_cast<size_t>(rows * g));
  features.Nodes(std::span(block.rows).subspan(static_cast<size_t>(begin), static_cast<size_t>(rows)), nodes.data());
  for (int64_t i = 0; i < rows; ++i) {
    std::copy_n(states.own.data() + (begin + i) * h, h, input.data() + i * width);
    std::copy_n(nodes.data() + i * told, told, input.data() + i * width + h);
  }
  LinearCpu(rows, input.data(), head_first_, first.data(), Activation::kGelu);
  LinearCpu(rows, first.data(), head_second_, second.data(), Activation::kGelu);
  LinearCpu(rows, second.data(), out_, out);
}

void CompactNetwork::Outputs(const CompactFeatures& features, const CompactGraph& graph, float* out) const {
  CompactBlocks blocks(graph, config_.rounds, kCompactBlock);
  States states;
  for (int64_t b = 0; b < blocks.count(); ++b) {
    const CompactBlock& block = blocks.Find(b);
    FindStates(features, block, graph.neighbours, states);
    ParallelFor(0, block.own(), kRowsPerTask, [&](int64_t begin, int64_t end) {
      Buffer<float> raw(static_cast<size_t>((end - begin) * out_.outputs()));
      Head(features, block, states, begin, end, raw.data());
      for (int64_t i = begin; i < end; ++i) {
        std::copy_n(raw.data() + (i - begin) * out_.outputs(), out_.outputs(),
                    out + int64_t{block.rows[static_cast<size_t>(i)]} * out_.outputs());
      }
    });
  }
}

float CompactNetwork::Fade(const float* node, const std::array<float, 3>& widths) const {
  float farthest = 0;
  for (size_t c = 0; c < low_.size(); ++c) {
    if (low_[c] > high_[c]) continue;
    float value = node[c];
    // A bounded feature hides how far a width lies beyond the bound. If training reached the bound, its true range is
    // unknown and the bounded feature decides; otherwise the unbounded width does.
    if (c < widths.size() && (widths[c] < value ? low_[c] > kLowestWidth : high_[c] < kHighestWidth)) value = widths[c];
    farthest = std::max({farthest, low_[c] - value, value - high_[c]});
  }
  return std::clamp((kFadeEnd - farthest) / (kFadeEnd - kFadeBegin), 0.0f, 1.0f);
}

float CompactNetwork::LargeGaussianFade(const std::array<float, 3>& widths) const {
  if (config_.copies == 1) return 1;
  const float middle = 2 * widths[1];  // ln(length in pixels)
  return std::clamp((std::log(kLargeFadeEnd) - middle) / std::log(kLargeFadeEnd / kLargeFadeBegin), 0.0f, 1.0f);
}

namespace {

Status CheckTask(const GaussianCloud& cloud, const CompactTask& task, const CompactConfig& config) {
  const int64_t copies = config.copies;
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  const int64_t n = cloud.size();
  if (n == 0) return Error{ErrorCode::kBadArgument, "the splat has no Gaussians"};
  if (n >= kMostRows / copies) {
    return Error{ErrorCode::kBadArgument,
                 Cat(WithThousands(n), " Gaussians cannot become ", copies, " each: more than 2^31 in all")};
  }
  if (task.pixel_sizes.size() != 1 && task.pixel_sizes.size() != static_cast<size_t>(n)) {
    return Error{ErrorCode::kBadArgument,
                 Cat(task.pixel_sizes.size(), " pixel sizes for ", n, " Gaussians: expected one, or one each")};
  }
  for (const float p : task.pixel_sizes) {
    if (!(p > 0) || !std::isfinite(p)) {
      return Error{ErrorCode::kBadArgument, Cat("pixel size ", p, " is not a positive length")};
    }
  }
  if (task.choice) ANCHORSPLAT_RETURN_IF_ERROR(Validate(*task.choice, copies));
  if (task.stand_in != nullptr) {
    const CompactConfig& other = task.stand_in->config();
    if (other.copies != 1 || other.neighbours != config.neighbours || other.rounds != config.rounds ||
        other.context != config.context || other.knows_kind != config.knows_kind) {
      return Error{ErrorCode::kBadArgument, "the network of the stand-ins makes more than one or sees something else"};
    }
  }
  if (task.block_gaussians < 1) return Error{ErrorCode::kBadArgument, "a block needs at least one Gaussian"};
  if (!(task.upscale >= 1) || !std::isfinite(task.upscale) || !(task.strength >= 0) || !std::isfinite(task.strength)) {
    return Error{ErrorCode::kBadArgument, Cat("upscale ", task.upscale, " must be at least 1 and the filter strength ",
                                              task.strength, " not negative")};
  }
  return {};
}

// The cloud and its per-Gaussian inputs, in spatially coherent order.
struct NearCloud {
  Buffer<int32_t> rows;  // of the input
  GaussianCloud cloud;
  Buffer<float> pixel_sizes;
  CompactGraph graph;
};

NearCloud BringTogether(GaussianCloud cloud, const CompactTask& task, const CompactConfig& config) {
  NearCloud near;
  CompactNeighbours neighbours = FindCompactNeighbours(cloud, config.neighbours, config.context);
  Buffer<int32_t> places(neighbours.rows.size());
  for (size_t place = 0; place < places.size(); ++place) {
    places[static_cast<size_t>(neighbours.rows[place])] = static_cast<int32_t>(place);
  }
  const auto order = [&](Buffer<float>& array, int64_t width) {
    const std::span<const float> all(array);
    array = ScatterRows({&all, 1}, width, places);
  };
  order(cloud.means, 3);
  order(cloud.log_scales, 3);
  order(cloud.quats, 4);
  order(cloud.opacity_logits, 1);
  order(cloud.sh, cloud.sh_stride());
  near.pixel_sizes.assign(task.pixel_sizes.begin(), task.pixel_sizes.end());
  if (near.pixel_sizes.size() > 1) order(near.pixel_sizes, 1);
  near.graph = GraphOfNeighbours(cloud, neighbours.neighbours, std::move(neighbours.index));
  near.rows = std::move(neighbours.rows);
  near.cloud = std::move(cloud);
  return near;
}

// Stands in for a fade: this Gaussian has no output.
constexpr float kLeftOut = -1;

// Output rows of a block's Gaussians: those with copies come first.
struct BlockPlaces {
  Buffer<int32_t> rows;   // of the input, in this order
  Buffer<int64_t> first;  // row of the first copy of each of the block's own
  int64_t copied = 0;     // Gaussians with copies
  int64_t uncopied = 0;   // Gaussians without
  int64_t made = 0;       // rows, including stand-ins
};

// Whether copies get stand-ins.
bool HasStandIns(const CompactTask& task, int64_t copies) {
  return task.stand_in != nullptr && copies > 1 && task.choice && !task.choice->copies;
}

// `each`: rows per Gaussian with copies.
BlockPlaces PlacesOf(const CompactBlock& block, const Buffer<float>& fades, const Buffer<int32_t>& rows, int64_t each) {
  BlockPlaces places;
  places.copied = std::ranges::count_if(fades, [](float fade) { return fade > 0; });
  places.uncopied = std::ranges::count(fades, 0.0f);
  places.made = each * places.copied + places.uncopied;
  places.rows.resize(static_cast<size_t>(places.copied + places.uncopied));
  places.first.resize(fades.size());
  int64_t next_copied = 0, next_uncopied = places.copied;
  for (size_t i = 0; i < fades.size(); ++i) {
    if (fades[i] == kLeftOut) continue;
    const bool has_copies = fades[i] > 0;
    const int64_t at = has_copies ? next_copied++ : next_uncopied++;
    places.rows[static_cast<size_t>(at)] = rows[static_cast<size_t>(block.rows[i])];
    places.first[i] = has_copies ? at : at + (each - 1) * places.copied;
  }
  return places;
}

// The block's copies, for the choice among them.
CopyGroups GroupsOf(const CompactTask& task, const BlockPlaces& places, int64_t copies) {
  CopyGroups groups{.count = places.copied, .copies = copies, .pixel_sizes = {}};
  groups.stand_ins = HasStandIns(task, copies);
  const auto closer = [&](float pixel) { return static_cast<float>(pixel / task.upscale); };
  if (task.pixel_sizes.size() == 1) groups.pixel_sizes = {closer(task.pixel_sizes.front())};
  for (int64_t g = 0; g < places.copied; ++g) {
    const int32_t row = places.rows[static_cast<size_t>(g)];
    if (task.pixel_sizes.size() > 1) groups.pixel_sizes.push_back(closer(task.pixel_sizes[static_cast<size_t>(row)]));
    if (!task.single.empty()) groups.single.push_back(std::ranges::binary_search(task.single, row) ? 1 : 0);
  }
  return groups;
}

}  // namespace

Buffer<float> CompactNetwork::TrainingFade(const CompactFeatures& features, const CompactBlock& block) const {
  Buffer<float> shares(static_cast<size_t>(block.own()));
  const int64_t told = NodeFeatures(config_);
  ParallelFor(0, block.own(), kRowsPerTask, [&](int64_t begin, int64_t end) {
    Buffer<float> nodes(static_cast<size_t>((end - begin) * told));
    features.Nodes(std::span(block.rows).subspan(static_cast<size_t>(begin), static_cast<size_t>(end - begin)),
                   nodes.data());
    for (int64_t i = begin; i < end; ++i) {
      shares[static_cast<size_t>(i)] =
          Fade(nodes.data() + (i - begin) * told, features.Widths(block.rows[static_cast<size_t>(i)]));
    }
  });
  return shares;
}

int64_t CompactNetwork::Make(const CompactFeatures& features, const CompactAnchors& anchors, const CompactBlock& block,
                             std::span<const float> fades, std::span<const int64_t> first, int64_t stride,
                             States& states, GaussianCloud& made) const {
  CompactConfig single = config_;
  single.copies = 1;
  const CopyStart start(config_.copies, config_.spread), single_start(1, 0);
  const std::vector<float> nothing(static_cast<size_t>(CompactOutputs(config_)), 0.0f);
  std::atomic<int64_t> not_finite = 0;
  FindStates(features, block, anchors.graph->neighbours, states);
  ParallelFor(0, block.own(), kRowsPerTask, [&](int64_t begin, int64_t end) {
    Buffer<float> raw(static_cast<size_t>((end - begin) * out_.outputs()));
    Head(features, block, states, begin, end, raw.data());
    for (int64_t place = begin; place < end; ++place) {
      const int64_t i = block.rows[static_cast<size_t>(place)];
      const float fade = fades[static_cast<size_t>(place)];
      const int64_t row = first[static_cast<size_t>(place)];
      if (fade == kLeftOut) continue;
      if (fade > 0) {
        const float* said = raw.data() + (place - begin) * out_.outputs();
        if (!AllFinite(said, out_.outputs())) {
          said = nothing.data();
          ++not_finite;
        }
        WriteCopies(config_, start, anchors, i, said, fade, row, stride, made);
      } else {
        WriteCopies(single, single_start, anchors, i, nothing.data(), 0, row, 1, made);
      }
    }
  });
  return not_finite;
}

Result<CompactResult> CompactNetwork::Apply(GaussianCloud cloud, const CompactTask& task) const {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckTask(cloud, task, config_));
  const int64_t n = cloud.size(), copies = config_.copies;
  const bool stand_ins = HasStandIns(task, copies);
  const double offset_side = config_.offset_unit == OffsetUnit::kCube ? CubeSide(cloud.means) : 0;
  CompactResult result;
  Stopwatch watch;
  std::vector<std::string> comments = std::move(cloud.comments);
  std::optional<CompactCheckpoint> checkpoint;
  if (!task.checkpoint.empty()) {
    const std::string network = Cat(fingerprint_, stand_ins ? task.stand_in->fingerprint_ : "");
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        CompactCheckpoint opened,
        CompactCheckpoint::Open(task.checkpoint, CheckpointSettings(network, cloud, task), task.resume));
    checkpoint.emplace(std::move(opened));
  }
  try {
    NearCloud near = BringTogether(std::move(cloud), task, config_);
    const CompactFeatures features(near.cloud, near.graph,
                                   {.pixel_sizes = near.pixel_sizes,
                                    .upscale = task.upscale,
                                    .strength = task.strength,
                                    .node_features = NodeFeatures(config_)});
    const CompactAnchors anchors{&near.cloud, &near.graph, near.pixel_sizes, task.upscale, task.strength, offset_side};
    CompactOutput output(n, copies, task.choice.value_or(CopyChoice{.copies = copies}));
    CompactBlockResult of_block;
    GaussianCloud& made = of_block.part.cloud;
    made.render_mode = near.cloud.render_mode;
    CompactBlocks blocks(near.graph, config_.rounds, task.block_gaussians);
    States states;
    result.times.neighbours = watch.Lap();
    Progress progress("Network", n);
    const auto add = [&](CopyGroups groups) {
      result.unlike_training += of_block.unlike_training;
      result.partly_unlike_training += of_block.partly_unlike_training;
      result.not_finite += of_block.not_finite;
      result.made += of_block.part.made;
      blocks.count() == 1 ? output.Take(std::move(of_block.part), std::move(groups))
                          : output.Append(of_block.part, std::move(groups));
    };
    int64_t next = 0;
    if (checkpoint) {
      Buffer<int32_t> at(static_cast<size_t>(n));
      for (int64_t place = 0; place < n; ++place) {
        at[static_cast<size_t>(near.rows[static_cast<size_t>(place)])] = static_cast<int32_t>(place);
      }
      for (;; ++result.resumed) {
        if (StopRequested()) return Error{ErrorCode::kInterrupted, "stopped"};
        ANCHORSPLAT_ASSIGN_OR_RETURN(const bool more, checkpoint->Next(near.cloud, of_block));
        if (!more) break;
        if (of_block.block < next || of_block.block >= blocks.count() ||
            !FitsBlock(of_block, at, task.block_gaussians, copies, output.defers_merging(), stand_ins)) {
          return Error{ErrorCode::kBadFile, Cat(task.checkpoint.string(), ": block ", of_block.block,
                                                " is not of this run; -w starts over")};
        }
        CopyGroups groups;
        if (output.defers_merging()) {
          BlockPlaces places;
          places.copied = of_block.part.copied;
          places.rows.assign(of_block.part.keys.begin(), of_block.part.keys.begin() + places.copied);
          groups = GroupsOf(task, places, copies);
        }
        add(std::move(groups));
        const int64_t before = next * task.block_gaussians;
        next = of_block.block + 1;
        progress.Advance(std::min(n, next * task.block_gaussians) - before);
      }
      if (next > 0)
        LogInfo(Cat("resuming after block ", next, " of ", blocks.count(), " from ", task.checkpoint.string()));
    }
    for (int64_t b = next; b < blocks.count(); ++b) {
      if (StopRequested()) return Error{ErrorCode::kInterrupted, "stopped"};
      const CompactBlock& block = blocks.Find(b);
      Buffer<float> fades = TrainingFade(features, block);
      of_block.unlike_training = of_block.partly_unlike_training = 0;
      for (size_t i = 0; i < fades.size(); ++i) {
        const int32_t row = near.rows[static_cast<size_t>(block.rows[i])];
        if (!task.in_region.empty() && task.in_region[static_cast<size_t>(row)] == 0) {
          fades[i] = kLeftOut;
          continue;
        }
        if (fades[i] < 1) ++(fades[i] > 0 ? of_block.partly_unlike_training : of_block.unlike_training);
        fades[i] = std::min(fades[i], LargeGaussianFade(features.Widths(block.rows[i])));
      }
      const BlockPlaces places = PlacesOf(block, fades, near.rows, copies + (stand_ins ? 1 : 0));
      progress.Advance(block.own());
      if (places.made == 0) continue;
      made.Resize(places.made, near.cloud.sh_degree);
      of_block.not_finite = Make(features, anchors, block, fades, places.first, places.copied, states, made);
      if (stand_ins) {
        Buffer<float> others = task.stand_in->TrainingFade(features, block);
        Buffer<int64_t> rows = places.first;
        for (size_t i = 0; i < fades.size(); ++i) {
          if (!(fades[i] > 0)) others[i] = kLeftOut;
          rows[i] += copies * places.copied;
        }
        task.stand_in->Make(features, anchors, block, others, rows, 1, states, made);
      }
      result.times.network += watch.Lap();
      of_block.block = b;
      CopyGroups groups = GroupsOf(task, places, copies);
      output.Merge(places.rows, groups, of_block.part);
      if (checkpoint) checkpoint->Append(of_block);
      add(std::move(groups));
      result.times.copies += watch.Lap();
    }
    near = {};
    of_block = {};
    result.cloud = output.Finish(result.chosen);
    result.times.order = watch.Lap();
  } catch (const DiskFull& none) {
    return Error{ErrorCode::kIo, none.what()};
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kBadArgument, Cat("no memory for ", WithThousands(n * copies), " Gaussians")};
  }
  result.cloud.comments = std::move(comments);
  return result;
}

}  // namespace anchorsplat

#include "published/torch/level_tensors.h"

#include <utility>

namespace anchorsplat {

namespace {

// Shares the memory of `values`, which `owner` keeps alive.
torch::Tensor View(const Buffer<int32_t>& values, std::vector<int64_t> shape, std::shared_ptr<const Level> owner) {
  return torch::from_blob(
      const_cast<int32_t*>(values.data()), shape, [owner = std::move(owner)](void*) {}, torch::kInt32);
}

}  // namespace

const std::array<LevelTensors::Pairs, kNeighbours>& LevelTensors::pairs() const {
  if (!pairs_) {
    pairs_ = std::make_shared<std::array<Pairs, kNeighbours>>();
    for (int64_t k = 0; k < kNeighbours; ++k) {
      const torch::Tensor column = neighbours.select(1, k);
      const torch::Tensor out = column.ne(kNoNeighbour).nonzero().squeeze(1);
      (*pairs_)[static_cast<size_t>(k)] = {out.to(torch::kInt32), column.index_select(0, out)};
    }
  }
  return *pairs_;
}

Hierarchy ToTensors(std::vector<Level> levels, int64_t patch_size, torch::Device device) {
  Hierarchy hierarchy;
  for (Level& level : levels) {
    LevelTensors tensors;
    const auto tables = std::make_shared<const Level>(std::move(level));
    tensors.tables = tables;
    tensors.count = tables->count;
    tensors.patch_size = patch_size;
    for (size_t slot = 0; slot < kCurves; ++slot) {
      const Buffer<int32_t>& rows = tables->patch_rows[slot];
      tensors.patch_rows[slot] = View(rows, {static_cast<int64_t>(rows.size())}, tables).to(device);
      tensors.positions[slot] = View(tables->positions[slot], {tables->count}, tables).to(device);
    }
    tensors.neighbours = View(tables->neighbours, {tables->count, kNeighbours}, tables).to(device);
    if (!tables->cluster.empty() || tables->count == 0) {
      tensors.cluster =
          View(tables->cluster, {static_cast<int64_t>(tables->cluster.size())}, tables).to(device, torch::kInt64);
    }
    hierarchy.push_back(std::move(tensors));
  }
  return hierarchy;
}

}  // namespace anchorsplat

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compact/merge_gaussians.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Merges the copies of one Gaussian step by step. Reusable: Load starts the next group.
class CopyGroup {
 public:
  // `most`: maximum copies per group. `invisible`: opacity below which a copy cannot be seen.
  CopyGroup(int64_t most, float invisible);

  // Loads rows first, first + stride, … of the cloud. `pixel`: closer-view pixel size, world units. `colors`: whether
  // costs are needed.
  void Load(const GaussianCloud& cloud, int64_t first, int64_t stride, int64_t copies, double pixel, bool colors);

  struct Step {
    float cost = 0;              // ≥ 0, or infinite
    uint8_t keep = 0, gone = 0;  // copies to merge; if equal, the copy is dropped
  };
  int64_t alive() const { return alive_; }
  double Mass() const;  // of the remaining copies, as MergeGaussian::mass
  // The next step, for alive() > 1: drops invisible copies first, then merges the cheapest pair.
  Step Next() const;
  void Apply(const Step& step);

  // Cost of showing row `row` of the cloud instead of the loaded copies, comparable to Step::cost; not finite if it
  // cannot be computed. Requires a group loaded with colours and merged into one.
  double CostOfStandIn(const GaussianCloud& cloud, int64_t row);

  // Writes merged copies to the rows that stay and sets keep[row] = 0 for the others. `into`, if not null: for each row
  // the row it was merged into, or −1 if it was dropped.
  void Write(GaussianCloud& cloud, std::vector<char>& keep, std::vector<int64_t>* into = nullptr) const;

 private:
  struct Copy {
    MergeGaussian gaussian;
    double stored_opacity = 0;
    bool alive = true;
    bool merged = false;
  };
  size_t At(size_t a, size_t b) const { return a * copies_.size() + b; }
  void FindCost(size_t a, size_t b);  // a < b
  // A row of the cloud in the local frame.
  MergeGaussian Seen(const GaussianCloud& cloud, int64_t row, double& stored_opacity) const;
  bool WriteMerged(const Copy& copy, const double* weights, int64_t row, GaussianCloud& cloud) const;

  double invisible_;
  int64_t first_ = 0, stride_ = 1, alive_ = 0;
  bool colors_ = false;
  double pixel_ = 1, dilation_ = 0;
  std::array<double, 3> origin_{};
  std::array<double, 9> frame_{};  // columns: the axes
  std::vector<Copy> copies_;
  std::vector<double> color_products_, weights_;  // [K,K]; weights: of the loaded colours in each copy's
  std::vector<double> costs_;                     // [K,K], of pairs a < b
  std::vector<MergeGaussian> loaded_;             // the copies as loaded, then the stand-in
  std::vector<double> stand_in_products_;         // [K+1,K+1] colour products of `loaded_`
};

}  // namespace anchorsplat

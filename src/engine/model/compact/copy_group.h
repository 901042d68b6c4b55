#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/gaussian_cloud.h"
#include "model/compact/merge_gaussians.h"

namespace anchorsplat {

// The copies of one Gaussian on their way to fewer. One object serves one group after the other.
class CopyGroup {
 public:
  // `most`: copies of a group. `invisible`: opacity below which nobody sees a copy.
  CopyGroup(int64_t most, float invisible);

  // Rows first, first + stride, … of the cloud. `pixel`: of the closer view, world units. `colors`: whether costs will
  // be asked for.
  void Load(const GaussianCloud& cloud, int64_t first, int64_t stride, int64_t copies, double pixel, bool colors);

  struct Step {
    float cost = 0;              // ≥ 0, or infinite
    uint8_t keep = 0, gone = 0;  // copies; the same one: it goes and leaves no trace
  };
  int64_t alive() const { return alive_; }
  double Mass() const;  // of what is left, as MergeGaussian::mass
  // What to do next, for alive() > 1: the invisible first, then the cheapest pair.
  Step Next() const;
  void Do(const Step& step);

  // What it costs of the picture of the loaded copies to show row `row` of the cloud instead, as the cost of a step;
  // not finite: there is no telling. Of a group that was loaded with colours and has been merged into one.
  double CostOfStandIn(const GaussianCloud& cloud, int64_t row);

  // Writes the merged copies into the rows of those that stay, and 0 into keep[row] of the others. `into`, where it is
  // asked for: for each row the one that it is a part of now, or -1 where it left no trace.
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
  // A row as it is seen in the frame.
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
  std::vector<double> costs_;                     // [K,K], of a < b
  std::vector<MergeGaussian> loaded_;             // as the copies were, then the stand-in
  std::vector<double> stand_in_products_;         // [K+1,K+1], of their colours
};

}  // namespace anchorsplat

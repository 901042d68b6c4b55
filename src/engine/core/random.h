#pragma once

#include <cstdint>

namespace anchorsplat {

// Random generator (xoshiro256**, seeded by splitmix64) with the same numbers on every platform, unlike the
// distributions of <random>.
class Random {
 public:
  explicit Random(uint64_t seed);
  uint64_t Next();   // 64 random bits
  double Uniform();  // [0,1)
  double Uniform(double a, double b) { return a + (b - a) * Uniform(); }
  double Normal();           // mean 0, variance 1 (Box–Muller)
  int64_t Below(int64_t n);  // 0 … n−1, n ≥ 1

 private:
  uint64_t state_[4];
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace anchorsplat

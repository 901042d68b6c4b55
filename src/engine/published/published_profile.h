#pragma once

#include <array>
#include <chrono>
#include <cstddef>

namespace anchorsplat {

// Steps of a forward pass, for profiling.
enum class NetworkStep { kLevels, kConvolution, kAttention, kLinear, kMlp, kNorm, kPooling, kHeads };
inline constexpr const char* kNetworkStepNames[] = {"levels", "convolution", "attention", "linear",
                                                    "mlp",    "norm",        "pooling",   "heads"};
inline constexpr size_t kNetworkSteps = std::size(kNetworkStepNames);

struct NetworkProfile {
  std::array<double, kNetworkSteps> seconds{};
  std::array<double, kNetworkSteps> multiply_adds{};  // of matrix products, attention and convolution

  double Seconds() const {
    double sum = 0;
    for (const double s : seconds) sum += s;
    return sum;
  }
  double MultiplyAdds() const {
    double sum = 0;
    for (const double m : multiply_adds) sum += m;
    return sum;
  }
};

// Adds its lifetime to a step of the profile; a null profile is ignored.
class ProfileScope {
 public:
  ProfileScope(NetworkProfile* profile, NetworkStep step, double multiply_adds = 0)
      : profile_(profile), step_(static_cast<size_t>(step)), begin_(std::chrono::steady_clock::now()) {
    if (profile_ != nullptr) profile_->multiply_adds[step_] += multiply_adds;
  }
  ~ProfileScope() {
    if (profile_ == nullptr) return;
    profile_->seconds[step_] += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  ProfileScope(const ProfileScope&) = delete;
  ProfileScope& operator=(const ProfileScope&) = delete;

 private:
  NetworkProfile* profile_;
  size_t step_;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace anchorsplat

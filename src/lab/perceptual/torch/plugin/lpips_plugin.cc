#include "perceptual/lpips_plugin.h"

#include <ATen/ATen.h>
#include <ATen/Parallel.h>
#include <c10/core/GradMode.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <mutex>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "perceptual/torch/lpips_network.h"

namespace anchorsplat {

namespace {

// A network with the features of the last truth: evaluations compare many pictures with the same one.
struct Loaded {
  explicit Loaded(LpipsNetwork n) : network(std::move(n)) {}

  LpipsNetwork network;
  std::mutex mutex;
  at::Tensor truth;  // [1,3,H,W]
  std::vector<at::Tensor> features;
};

void SetError(std::string_view text, char* error, size_t size) {
  const size_t length = std::min(text.size(), size - 1);
  std::memcpy(error, text.data(), length);
  error[length] = 0;
}

void* Open(int net, const float* const* tensors, const int64_t* sizes, size_t count, char* error, size_t error_size) {
  try {
    std::vector<std::span<const float>> values;
    for (size_t i = 0; i < count; ++i) values.emplace_back(tensors[i], static_cast<size_t>(sizes[i]));
    auto network = LpipsNetwork::Make(static_cast<LpipsNet>(net), values);
    if (network.ok()) return new Loaded(*std::move(network));
    SetError(network.error().message, error, error_size);
  } catch (const std::exception& failure) {
    SetError(failure.what(), error, error_size);
  }
  return nullptr;
}

void Close(void* network) { delete static_cast<Loaded*>(network); }

double Distance(void* network, const float* a, const float* b, int64_t height, int64_t width, int threads, char* error,
                size_t error_size) {
  try {
    const c10::NoGradGuard no_gradients;
    if (at::get_num_threads() != threads) at::set_num_threads(threads);
    const auto picture = [&](const float* pixels) {
      return at::from_blob(const_cast<float*>(pixels), {1, 3, height, width}, at::kFloat);
    };
    Loaded& loaded = *static_cast<Loaded*>(network);
    const std::lock_guard<std::mutex> lock(loaded.mutex);
    const at::Tensor truth = picture(b);
    if (!loaded.truth.defined() || !at::equal(loaded.truth, truth)) {
      loaded.truth = truth.clone();
      loaded.features = loaded.network.Features(truth);
    }
    return loaded.network.Distance(loaded.network.Features(picture(a)), loaded.features).item<double>();
  } catch (const std::exception& failure) {
    SetError(failure.what(), error, error_size);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

constexpr LpipsPlugin kPlugin = {kLpipsPluginVersion, Open, Close, Distance};

}  // namespace

}  // namespace anchorsplat

extern "C" const anchorsplat::LpipsPlugin* anchorsplat_lpips_plugin() { return &anchorsplat::kPlugin; }

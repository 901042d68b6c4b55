#pragma once

#include <cstddef>
#include <cstdint>

namespace anchorsplat {

// What the program and the LPIPS plugin know of each other: a table of functions on plain pointers, so that neither
// depends on how the other was compiled. The plugin exports kLpipsPluginSymbol, a function () → const LpipsPlugin*.
// Functions that fail return null or NaN and leave a sentence in `error`.
inline constexpr int kLpipsPluginVersion = 1;
inline constexpr const char* kLpipsPluginSymbol = "anchorsplat_lpips_plugin";

struct LpipsPlugin {
  int version;  // kLpipsPluginVersion
  // `tensors`: the values of LpipsTensors(net), `sizes` of them each; copied.
  void* (*open)(int net, const float* const* tensors, const int64_t* sizes, size_t count, char* error,
                size_t error_size);
  void (*close)(void* network);
  // `a`, `b`: [3,height,width], 0–1. What was calculated of `b` is kept for the next call. One call at a time runs.
  double (*distance)(void* network, const float* a, const float* b, int64_t height, int64_t width, int threads,
                     char* error, size_t error_size);
};

}  // namespace anchorsplat

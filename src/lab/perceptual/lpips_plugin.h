#pragma once

#include <cstddef>
#include <cstdint>

namespace anchorsplat {

// Interface between the program and the LPIPS plugin: a table of functions on plain pointers, so that both can be
// compiled differently. The plugin exports kLpipsPluginSymbol, a function () → const LpipsPlugin*. On failure,
// functions return null or NaN and write a sentence to `error`.
inline constexpr int kLpipsPluginVersion = 1;
inline constexpr const char* kLpipsPluginSymbol = "anchorsplat_lpips_plugin";

struct LpipsPlugin {
  int version;  // kLpipsPluginVersion
  // `tensors`: values of LpipsTensors(net), each of length `sizes[i]`; copied.
  void* (*open)(int net, const float* const* tensors, const int64_t* sizes, size_t count, char* error,
                size_t error_size);
  void (*close)(void* network);
  // `a`, `b`: [3,height,width], 0–1. Features of `b` are cached for the next call. Not thread-safe.
  double (*distance)(void* network, const float* a, const float* b, int64_t height, int64_t width, int threads,
                     char* error, size_t error_size);
};

}  // namespace anchorsplat

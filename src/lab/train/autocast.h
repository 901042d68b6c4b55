#pragma once

#include <ATen/autocast_mode.h>
#include <torch/torch.h>

#include "train/train_config.h"

namespace anchorsplat {

// Enables automatic mixed precision during its lifetime.
class Autocast {
 public:
  Autocast(Precision precision, torch::Device device) : on_(precision != Precision::kFp32), type_(device.type()) {
    if (!on_) return;
    at::autocast::set_autocast_dtype(type_, precision == Precision::kBf16 ? at::kBFloat16 : at::kHalf);
    at::autocast::set_autocast_enabled(type_, true);
  }
  ~Autocast() {
    if (!on_) return;
    at::autocast::set_autocast_enabled(type_, false);
    at::autocast::clear_cache();
  }
  Autocast(const Autocast&) = delete;
  Autocast& operator=(const Autocast&) = delete;

 private:
  bool on_;
  at::DeviceType type_;
};

}  // namespace anchorsplat

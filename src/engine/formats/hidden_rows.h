#pragma once

#include <cstdint>
#include <filesystem>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "formats/registry.h"
#include "formats/strays.h"

namespace anchorsplat {

// Gaussians that a format must not show: those that nobody draws whatever their opacity (not IsUsable), where it cannot
// say all their values, and strays. Writing them without opacity is decided here for all formats, so that no writer
// meets any.
struct HiddenRows {
  Buffer<int64_t> unusable;  // ascending
  Strays strays;
  // The cloud with copies, without opacity, of the row before in their places, so that they neither show nor widen any
  // range. Nothing where none is hidden: then it is written as it is.
  GaussianCloud written;

  bool any() const { return !written.empty(); }
};
HiddenRows HideRows(const SplatFormat& format, const CloudView& cloud);

// Says how many are hidden, and why.
void WarnOfHiddenRows(const std::filesystem::path& path, const SplatFormat& format, const HiddenRows& hidden);

}  // namespace anchorsplat

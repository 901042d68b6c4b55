#pragma once

#include <cstdint>
#include <filesystem>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "formats/registry.h"
#include "formats/strays.h"

namespace anchorsplat {

// Gaussians that must not be visible in a format: unusable rows, if it cannot store all their values, and strays
// (strays.h). They are replaced here for all formats, so that writers never see them.
struct HiddenRows {
  Buffer<int64_t> unusable;  // ascending
  Strays strays;
  // The cloud with each hidden row replaced by a zero-opacity copy of the previous row, which neither shows nor widens
  // a range. Empty if nothing is hidden: write the cloud as it is.
  GaussianCloud written;

  bool any() const { return !written.empty(); }
};
HiddenRows HideRows(const SplatFormat& format, const CloudView& cloud);

// Warns how many are hidden, and why.
void WarnOfHiddenRows(const std::filesystem::path& path, const SplatFormat& format, const HiddenRows& hidden);

}  // namespace anchorsplat

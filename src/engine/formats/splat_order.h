#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Orders for writing a cloud, as row numbers. Ties keep the cloud's order; unusable rows come last. These cannot fail.

// Along a Morton (Z-order) curve with 2²¹ cells per axis of the bounding box, so that neighbours in the file are
// neighbours in space: chunks have small ranges, and compressors find more redundancy. Strays (strays.h) follow on a
// separate curve, so that they share chunks with as few others as possible.
Buffer<uint32_t> MortonOrder(const CloudView& cloud);
// The same for positions [N,3], all finite.
Buffer<uint32_t> MortonOrder(std::span<const float> means);

// By size × opacity, exp(Σ log-scales) · sigmoid(logit), largest first: for viewers that show a file while it loads.
Buffer<uint32_t> ImportanceOrder(const CloudView& cloud);

// The order for a writer: `asked`, or the format's default. Empty: unchanged.
Buffer<uint32_t> WriteOrder(const CloudView& cloud, SplatOrder asked, SplatOrder of_format);

}  // namespace anchorsplat

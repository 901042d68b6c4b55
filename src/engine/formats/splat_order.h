#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Orders in which a cloud is written, as row numbers. Ties keep the order of the cloud; rows that nobody
// draws come last. Errors do not exist: any cloud has every order.

// Along a Morton (Z-order) curve of 2²¹ cells per axis through their box, so that neighbours in the file are neighbours
// in space: ranges of chunks become small and general compressors find more. What is far out (strays.h) follows along a
// curve of its own: no chunk with it in has more of the others than it must.
Buffer<uint32_t> MortonOrder(const CloudView& cloud);
// The same of places alone, [N,3], all finite.
Buffer<uint32_t> MortonOrder(std::span<const float> means);

// By size × opacity, largest first: exp(Σ log-scales) · sigmoid(logit), what viewers that show a file while it loads
// want to have first.
Buffer<uint32_t> ImportanceOrder(const CloudView& cloud);

// The order a writer uses: `asked`, or what the format likes. Empty: as in the cloud.
Buffer<uint32_t> WriteOrder(const CloudView& cloud, SplatOrder asked, SplatOrder of_format);

}  // namespace anchorsplat

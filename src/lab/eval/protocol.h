#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "core/image.h"

namespace anchorsplat {

// Which views are measured, how renders are post-processed, and how means are taken.
enum class Protocol {
  // The published evaluation of AnchorSplat, for numbers comparable with its tables: views by name without the first
  // and the last five (140 of 146, most of which the low-quality fit was trained on); values truncated to 8 bits
  // (⌊255·x⌋, half a step too dark on average); mean over all pictures of all objects.
  kUpstream,
  // Views the low-quality fit never saw: every eighth by name (19 of 146), as fits hold them out, or those that the
  // training cameras do not contain. Renders are clamped to 0–1, not quantised; mean over an object's views, then over
  // objects.
  kHeldOut,
};

const char* ProtocolName(Protocol protocol);  // "upstream", "heldout"
std::optional<Protocol> FindProtocol(std::string_view name);

inline constexpr int kHeldOutEvery = 8;  // gsplat's trainer, test_every

// Indices into `count` views sorted by name.
std::vector<size_t> UpstreamViews(size_t count);
std::vector<size_t> HeldOutViews(size_t count);

// At most `most` of `views`, evenly chosen; all if `most` is 0.
std::vector<size_t> SubsampleEvenly(const std::vector<size_t>& views, size_t most);

// Post-processes a render as the protocol demands.
void TreatRender(Protocol protocol, Image& render);

// ⌊255·x⌋ / 255 for values in 0–1. 8-bit pictures are unchanged.
void TruncateTo8Bits(Image& image);

}  // namespace anchorsplat

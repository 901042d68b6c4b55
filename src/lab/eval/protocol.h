#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "core/image.h"

namespace anchorsplat {

// Which views are measured, how renders are treated, and how the mean is taken.
enum class Protocol {
  // What the published evaluation of AnchorSplat does, so that numbers can stand beside its tables: views in order of
  // their names without the first and the last five (140 of 146, most of which the low-quality fit was trained on);
  // values cut down to 8 bits (⌊255·x⌋, on average half a step too dark); mean over all pictures of all objects.
  kUpstream,
  // Views the low-quality fit never saw: every eighth by name (19 of 146), as fits hold them out, or those that the
  // training cameras do not name. Renders are clamped to 0–1 and not quantised; mean over the views of an object, then
  // over objects.
  kHeldOut,
};

const char* ProtocolName(Protocol protocol);  // "upstream", "heldout"
std::optional<Protocol> FindProtocol(std::string_view name);

inline constexpr int kHeldOutEvery = 8;  // gsplat's trainer, test_every

// Indices into `count` views in order of their names.
std::vector<size_t> UpstreamViews(size_t count);
std::vector<size_t> HeldOutViews(size_t count);

// `most` of `views`, evenly spread; all of them when there are not as many, or when `most` is 0.
std::vector<size_t> Thinned(const std::vector<size_t>& views, size_t most);

// A render as the protocol measures it.
void TreatRender(Protocol protocol, Image& render);

// ⌊255·x⌋ / 255 of values in 0–1. Pictures of 8 bits stay as they are.
void TruncateTo8Bits(Image& image);

}  // namespace anchorsplat

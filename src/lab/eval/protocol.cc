#include "eval/protocol.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

namespace {

constexpr size_t kUpstreamFirst = 1;  // dropped at the beginning of the sorted names
constexpr size_t kUpstreamLast = 5;   // dropped at the end
constexpr int64_t kPixels = 1 << 16;  // per task

}  // namespace

const char* ProtocolName(Protocol protocol) { return protocol == Protocol::kUpstream ? "upstream" : "heldout"; }

std::optional<Protocol> FindProtocol(std::string_view name) {
  for (const Protocol protocol : {Protocol::kUpstream, Protocol::kHeldOut}) {
    if (name == ProtocolName(protocol)) return protocol;
  }
  return std::nullopt;
}

std::vector<size_t> UpstreamViews(size_t count) {
  const bool trimmed = count > kUpstreamFirst + kUpstreamLast;
  std::vector<size_t> views;
  for (size_t i = trimmed ? kUpstreamFirst : 0; i + (trimmed ? kUpstreamLast : 0) < count; ++i) views.push_back(i);
  return views;
}

std::vector<size_t> HeldOutViews(size_t count) {
  std::vector<size_t> views;
  for (size_t i = 0; i < count; i += kHeldOutEvery) views.push_back(i);
  return views;
}

std::vector<size_t> SubsampleEvenly(const std::vector<size_t>& views, size_t most) {
  if (most == 0 || most >= views.size()) return views;
  std::vector<size_t> out;
  for (size_t i = 0; i < most; ++i) out.push_back(views[i * views.size() / most]);
  return out;
}

void TruncateTo8Bits(Image& image) {
  ParallelFor(0, static_cast<int64_t>(image.pixels.size()), kPixels, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      float& value = image.pixels[static_cast<size_t>(i)];
      value = std::floor(255.0f * value) / 255.0f;
    }
  });
}

void TreatRender(Protocol protocol, Image& render) {
  Clamp01(render);
  if (protocol == Protocol::kUpstream) TruncateTo8Bits(render);
}

}  // namespace anchorsplat

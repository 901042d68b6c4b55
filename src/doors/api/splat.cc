#include <anchorsplat/splat.h>

#include <algorithm>

#include "api/bridge.h"

namespace anchorsplat {

Expected<void> CheckShape(const SplatView& view) {
  return InRun<void>({}, [&] { return Validate(ToCloud(view)); });
}

Splat::Splat() = default;
Splat::~Splat() = default;
Splat::Splat(Splat&& other) noexcept = default;
Splat& Splat::operator=(Splat&& other) noexcept = default;
Splat::Splat(std::unique_ptr<Owned> owned) : owned_(std::move(owned)) {}

Expected<Splat> Splat::OfSize(int64_t count, int sh_degree) {
  return InRun<Splat>({}, [&]() -> Result<Splat> {
    constexpr int64_t kMost = int64_t{1} << 31;  // limit of the engine
    if (count < 0 || count > kMost || sh_degree < 0 || sh_degree > kMaxShDegree) {
      return Error{ErrorCode::kBadArgument, "a splat must have 0 to 2^31 Gaussians of SH degree 0 to 3"};
    }
    GaussianCloud cloud;
    cloud.Resize(count, sh_degree);
    for (Buffer<float>* array : {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh}) {
      std::ranges::fill(*array, 0.0f);
    }
    return SplatAccess::Make(std::move(cloud));
  });
}

Expected<Splat> Splat::CopyOf(const SplatView& view) {
  return InRun<Splat>({}, [&]() -> Result<Splat> {
    ANCHORSPLAT_RETURN_IF_ERROR(Validate(ToCloud(view)));
    return SplatAccess::Make(anchorsplat::CopyOf(ToCloud(view)));
  });
}

int64_t Splat::size() const { return owned_ ? owned_->cloud.size() : 0; }
int Splat::sh_degree() const { return owned_ ? owned_->cloud.sh_degree : 0; }
std::span<float> Splat::means() { return owned_ ? std::span<float>(owned_->cloud.means) : std::span<float>(); }
std::span<float> Splat::log_scales() {
  return owned_ ? std::span<float>(owned_->cloud.log_scales) : std::span<float>();
}
std::span<float> Splat::quats() { return owned_ ? std::span<float>(owned_->cloud.quats) : std::span<float>(); }
std::span<float> Splat::opacity_logits() {
  return owned_ ? std::span<float>(owned_->cloud.opacity_logits) : std::span<float>();
}
std::span<float> Splat::sh() { return owned_ ? std::span<float>(owned_->cloud.sh) : std::span<float>(); }

void Splat::set_rasterization(std::optional<Rasterization> rasterization) {
  if (owned_) owned_->cloud.render_mode = ToMode(rasterization);
}

void Splat::set_comments(std::vector<std::string> comments) {
  if (owned_) owned_->cloud.comments = std::move(comments);
}

void Splat::set_origin(const std::array<double, 3>& origin) {
  if (owned_) owned_->cloud.origin = origin;
}

SplatView Splat::view() const { return owned_ ? ToView(owned_->cloud) : SplatView(); }

}  // namespace anchorsplat

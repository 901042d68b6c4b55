#include "fit/picture_cache.h"

#include <utility>

#include "cameras/photograph.h"
#include "core/parallel.h"
#include "core/text.h"
#include "formats/quantize.h"

namespace anchorsplat {

namespace {
constexpr int64_t kGrain = 1 << 16;  // pixels per task
constexpr float kByte = 1.0f / 255;
}  // namespace

PictureCache::PictureCache(std::vector<Camera> views, const std::array<float, 3>& background, int64_t budget)
    : views_(std::move(views)), background_(background), left_(budget), stored_(views_.size()) {}

Result<PictureCache::Stored> PictureCache::Read(int64_t view) const {
  const Camera& camera = views_[static_cast<size_t>(view)];
  const Pinhole& size = camera.intrinsics;
  ANCHORSPLAT_ASSIGN_OR_RETURN(ViewPicture read, ReadPhotograph(camera));
  const Image& image = read.image;
  if (image.width != size.width || image.height != size.height) {
    return Error{ErrorCode::kBadFile, Cat(camera.image.string(), ": ", image.width, "x", image.height,
                                          " pixels, expected ", size.width, "x", size.height)};
  }
  Stored fresh{image.channels, Buffer<uint8_t>(image.pixels.size()), std::move(read.ignored)};
  for (size_t i = 0; i < image.pixels.size(); ++i) fresh.pixels[i] = QuantizeByte(image.pixels[i] * 255);
  return fresh;
}

void PictureCache::Keep(int64_t view, Stored&& fresh) {
  const auto bytes = static_cast<int64_t>(fresh.pixels.size() + fresh.ignored.size());
  if (bytes > left_) return;
  left_ -= bytes;
  stored_[static_cast<size_t>(view)] = std::move(fresh);
}

Status PictureCache::Load(int64_t view, Image& picture, Buffer<uint8_t>& ignored) {
  const Stored& kept = stored_[static_cast<size_t>(view)];
  const Pinhole& size = views_[static_cast<size_t>(view)].intrinsics;
  if (kept.channels != 0) {
    Unpack(kept, size, picture);
    ignored = kept.ignored;
    return {};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(Stored fresh, Read(view));
  Unpack(fresh, size, picture);
  ignored = fresh.ignored;
  Keep(view, std::move(fresh));
  return {};
}

Result<PackedPicture> PictureCache::LoadPacked(int64_t view) {
  const auto packed = [](const Stored& stored) {
    return PackedPicture{stored.channels, stored.pixels, stored.ignored};
  };
  const Stored& kept = stored_[static_cast<size_t>(view)];
  if (kept.channels != 0) return packed(kept);
  ANCHORSPLAT_ASSIGN_OR_RETURN(passing_, Read(view));
  const auto bytes = static_cast<int64_t>(passing_.pixels.size() + passing_.ignored.size());
  if (bytes > left_) return packed(passing_);
  Keep(view, std::move(passing_));
  return packed(kept);
}

void PictureCache::LoadAhead(std::span<const int64_t> views) {
  if (views.empty() || stored_[static_cast<size_t>(views.front())].channels != 0) return;
  const auto most = static_cast<size_t>(ThreadCount());
  int64_t room = left_, pixels = 0;
  std::vector<int64_t> chosen;
  for (const int64_t view : views) {
    if (chosen.size() == most) break;
    if (stored_[static_cast<size_t>(view)].channels != 0) continue;
    const Pinhole& size = views_[static_cast<size_t>(view)].intrinsics;
    const int64_t own = int64_t{size.width} * size.height;
    pixels += own;
    room -= 5 * own;  // upper bound in bytes: colour, alpha and mask
    if (room < 0 || pixels > kDecodedAtOnce) break;
    chosen.push_back(view);
  }
  if (chosen.size() < 2) return;  // Load is as good
  std::vector<Stored> read(chosen.size());
  ParallelFor(0, static_cast<int64_t>(chosen.size()), 1, [&](int64_t k, int64_t) {
    auto fresh = Read(chosen[static_cast<size_t>(k)]);
    if (fresh.ok()) read[static_cast<size_t>(k)] = *std::move(fresh);
  });
  for (size_t k = 0; k < chosen.size(); ++k) {
    if (read[k].channels != 0) Keep(chosen[k], std::move(read[k]));
  }
}

void PictureCache::Unpack(const Stored& stored, const Pinhole& size, Image& picture) const {
  if (picture.width != size.width || picture.height != size.height || picture.channels != 3) {
    picture = Image(size.width, size.height, 3);
  }
  const int64_t plane = picture.plane();
  ParallelFor(0, plane, kGrain, [&](int64_t begin, int64_t end) {
    const uint8_t* alpha = stored.channels == 4 ? stored.pixels.data() + 3 * plane : nullptr;
    for (int c = 0; c < 3; ++c) {
      const uint8_t* in = stored.pixels.data() + c * plane;
      float* out = picture.channel(c);
      if (alpha == nullptr) {
        for (int64_t i = begin; i < end; ++i) out[i] = static_cast<float>(in[i]) * kByte;
        continue;
      }
      const float behind = background_[static_cast<size_t>(c)];
      for (int64_t i = begin; i < end; ++i) {
        const float a = static_cast<float>(alpha[i]) * kByte;
        out[i] = static_cast<float>(in[i]) * kByte * a + behind * (1 - a);
      }
    }
  });
}

}  // namespace anchorsplat

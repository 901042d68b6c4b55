#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// A picture in bytes.
struct PackedPicture {
  int channels = 0;                  // 3, or 4 with alpha, still to be composited over a background
  std::span<const uint8_t> pixels;   // [channels,H,W]
  std::span<const uint8_t> ignored;  // [H,W] as of PictureCache::Load
};

// Decodes and undistorts pictures of views (cameras/photograph.h) on first use and caches them as bytes within
// `budget`. The rest is decoded each time: with views in random order no caching policy does better. One object per
// thread.
class PictureCache {
 public:
  static constexpr int64_t kDefaultBudget = int64_t{4} << 30;  // bytes: 20,000 pictures of 256², 1,300 of 1024²

  // Composites alpha over `background`, before rounding: colour and alpha are kept at 8 bits each.
  PictureCache(std::vector<Camera> views, const std::array<float, 3>& background, int64_t budget = kDefaultBudget);

  const std::vector<Camera>& views() const { return views_; }

  // Picture of views()[view] as [3,H,W] in 0–1, and its ignored pixels: [H,W], 1 = ignored, empty if none.
  // Errors: those of ReadPhotograph; kBadFile if the picture's size is not its camera's.
  Status Load(int64_t view, Image& picture, Buffer<uint8_t>& ignored);

  // The same in bytes, not composited. Valid until the next call.
  Result<PackedPicture> LoadPacked(int64_t view);
  const std::array<float, 3>& background() const { return background_; }

  // Announces the next views, in order. If the first is not cached but fits, decodes it in parallel with others after
  // it, up to the number of threads and kDecodedAtOnce (decoding one picture is single-threaded). Does not change
  // results. Unreadable pictures are not cached; Load reports them.
  void LoadAhead(std::span<const int64_t> views);

 private:
  struct Stored {
    int channels = 0;        // 3, or 4 with alpha; 0: not kept
    Buffer<uint8_t> pixels;  // [C,H,W]
    Buffer<uint8_t> ignored;
  };
  static constexpr int64_t kDecodedAtOnce = int64_t{1} << 26;  // pixels, 16 bytes each during decoding
  Result<Stored> Read(int64_t view) const;
  void Keep(int64_t view, Stored&& fresh);  // if it fits
  void Unpack(const Stored& stored, const Pinhole& size, Image& picture) const;

  std::vector<Camera> views_;
  std::array<float, 3> background_;
  int64_t left_;  // bytes of the budget
  std::vector<Stored> stored_;
  Stored passing_;  // LoadPacked's picture, if not cached
};

}  // namespace anchorsplat

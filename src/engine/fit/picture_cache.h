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

// A picture as it is kept.
struct PackedPicture {
  int channels = 0;                  // 3, or 4 with alpha, which is to be laid over a background
  std::span<const uint8_t> pixels;   // [channels,H,W]
  std::span<const uint8_t> ignored;  // [H,W] as of PictureCache::Load
};

// The pictures of views, decoded and undone of their lens when first asked for (cameras/photograph.h) and kept as bytes
// while they fit into `budget`. What does not fit is made each time: with views in random order no other choice of what
// to keep would be asked for more often. One object per thread of control.
class PictureCache {
 public:
  static constexpr int64_t kDefaultBudget = int64_t{4} << 30;  // bytes: 20,000 pictures of 256², 1,300 of 1024²

  // Pixels with alpha are laid over `background`, before rounding: 8 bits are kept of colour and alpha each.
  PictureCache(std::vector<Camera> views, const std::array<float, 3>& background, int64_t budget = kDefaultBudget);

  const std::vector<Camera>& views() const { return views_; }

  // The picture of views()[view] as [3,H,W] in 0–1, and where it says nothing: [H,W], 1 there, empty for nowhere.
  // Errors: those of ReadPhotograph; kBadFile when the picture has not its camera's size.
  Status Load(int64_t view, Image& picture, Buffer<uint8_t>& ignored);

  // The same as bytes, over no background yet. Valid until the next call.
  Result<PackedPicture> LoadPacked(int64_t view);
  const std::array<float, 3>& background() const { return background_; }

  // `views` are asked for next, in this order. If the first of them is not kept but would fit, it is decoded at the
  // same time as others after it, as many as there are threads for and kDecodedAtOnce allows: a picture is decoded by
  // one thread. Changes no result. What cannot be read is not kept, and Load says why when its turn comes.
  void LoadAhead(std::span<const int64_t> views);

 private:
  struct Stored {
    int channels = 0;        // 3, or 4 with alpha; 0: not kept
    Buffer<uint8_t> pixels;  // [C,H,W]
    Buffer<uint8_t> ignored;
  };
  static constexpr int64_t kDecodedAtOnce = int64_t{1} << 26;  // pixels, which take 16 bytes each while at work
  Result<Stored> Read(int64_t view) const;
  void Keep(int64_t view, Stored&& fresh);  // if it fits
  void Unpack(const Stored& stored, const Pinhole& size, Image& picture) const;

  std::vector<Camera> views_;
  std::array<float, 3> background_;
  int64_t left_;  // bytes of the budget
  std::vector<Stored> stored_;
  Stored passing_;  // what LoadPacked gave and there is no room for
};

}  // namespace anchorsplat

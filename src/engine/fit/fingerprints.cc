#include "fit/fingerprints.h"

#include <array>
#include <cstdint>

#include "core/fingerprint.h"
#include "core/parallel.h"
#include "io/mapped_file.h"

namespace anchorsplat {

std::string FingerprintOf(const GaussianCloud& cloud) {
  Fingerprint print;
  for (const auto* array : {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh}) {
    print.Add(*array);
  }
  return print.text();
}

std::string FingerprintOf(const std::vector<Camera>& cameras, double scene_scale) {
  Fingerprint print;
  for (const Camera& c : cameras) {
    const Pinhole& k = c.intrinsics;
    print.Add(c.world_to_camera.rotation);
    print.Add(c.world_to_camera.translation);
    print.Add(std::array{k.fx, k.fy, k.cx, k.cy, static_cast<double>(k.width), static_cast<double>(k.height)});
    const Photograph& photograph = c.photograph;
    if (photograph.orientation != 1 || photograph.downscale != 1) {
      print.Add(std::array{photograph.orientation, photograph.downscale});
    }
    if (photograph.lens.IsIdentity()) continue;
    const Pinhole& b = photograph.intrinsics;
    print.Add(std::array{b.fx, b.fy, b.cx, b.cy, static_cast<double>(b.width), static_cast<double>(b.height)});
    print.Add(std::array{static_cast<int>(photograph.lens.model)});
    print.Add(photograph.lens.radial);
    print.Add(photograph.lens.denominator);
    print.Add(photograph.lens.tangential);
    if (photograph.lens.skew != 0) print.Add(std::array{photograph.lens.skew});
  }
  print.Add(std::array{scene_scale});
  return print.text();
}

Result<std::string> FingerprintOfPictures(const std::vector<Camera>& cameras) {
  std::vector<uint64_t> prints(cameras.size());
  std::vector<Status> read(cameras.size());
  ParallelFor(0, std::ssize(cameras), 1, [&](int64_t first, int64_t last) {
    for (auto i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i) {
      const auto file = MappedFile::Open(cameras[i].image);
      if (!file.ok()) {
        read[i] = file.error();
        continue;
      }
      Fingerprint print;
      print.Add(file->bytes());
      if (!cameras[i].photograph.mask.empty()) {
        const auto mask = MappedFile::Open(cameras[i].photograph.mask);
        if (!mask.ok()) {
          read[i] = mask.error();
          continue;
        }
        print.Add(mask->bytes());
      }
      prints[i] = print.value();
    }
  });
  for (const Status& status : read) ANCHORSPLAT_RETURN_IF_ERROR(status);
  Fingerprint all;
  all.Add(prints);
  return all.text();
}

}  // namespace anchorsplat

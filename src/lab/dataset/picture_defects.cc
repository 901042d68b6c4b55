#include "dataset/picture_defects.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <string>
#include <system_error>
#include <vector>

#include "cameras/camera_io.h"
#include "cameras/colmap_writer.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/text.h"
#include "dataset/object_name.h"
#include "images/image_io.h"
#include "images/jpeg_file.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr double kMostPixels = 64;

// Gaussian weights at integer pixels up to three σ, with sum 1.
std::vector<float> BlurWeights(double sigma) {
  const int radius = std::max(1, static_cast<int>(std::ceil(3 * sigma)));
  std::vector<float> weights;
  double sum = 0;
  for (int k = -radius; k <= radius; ++k) sum += std::exp(-0.5 * k * k / (sigma * sigma));
  for (int k = -radius; k <= radius; ++k) {
    weights.push_back(static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma)) / sum));
  }
  return weights;
}

// Separable blur of every channel; replicates the border.
Image Blurred(const Image& image, double sigma) {
  const std::vector<float> weights = BlurWeights(sigma);
  const int radius = static_cast<int>(weights.size() / 2);
  Image rows(image.width, image.height, image.channels), out = rows;
  const auto blur = [&](const Image& from, Image& to, bool along_x) {
    for (int c = 0; c < from.channels; ++c) {
      for (int y = 0; y < from.height; ++y) {
        for (int x = 0; x < from.width; ++x) {
          float sum = 0;
          for (int k = -radius; k <= radius; ++k) {
            const int at_x = along_x ? std::clamp(x + k, 0, from.width - 1) : x;
            const int at_y = along_x ? y : std::clamp(y + k, 0, from.height - 1);
            sum += weights[static_cast<size_t>(k + radius)] * from.at(c, at_y, at_x);
          }
          to.at(c, y, x) = sum;
        }
      }
    }
  };
  blur(image, rows, true);
  blur(rows, out, false);
  return out;
}

// Minimum over the disc around each pixel; ignores what is beyond the border.
Image Eroded(const Image& alpha, double radius) {
  const int reach = static_cast<int>(radius);
  Image out(alpha.width, alpha.height, 1);
  for (int y = 0; y < alpha.height; ++y) {
    for (int x = 0; x < alpha.width; ++x) {
      float least = 1;
      for (int dy = -reach; dy <= reach; ++dy) {
        for (int dx = -reach; dx <= reach; ++dx) {
          const bool inside = y + dy >= 0 && y + dy < alpha.height && x + dx >= 0 && x + dx < alpha.width;
          if (inside && dx * dx + dy * dy <= radius * radius) least = std::min(least, alpha.at(0, y + dy, x + dx));
        }
      }
      out.at(0, y, x) = least;
    }
  }
  return out;
}

// The picture's alpha [1,H,W]; all 1 if it has none.
Image AlphaOf(const Image& picture) {
  Image alpha(picture.width, picture.height, 1);
  for (int64_t i = 0; i < picture.plane(); ++i) alpha.pixels[static_cast<size_t>(i)] = 1;
  if (picture.channels == 4) std::copy_n(picture.channel(3), picture.plane(), alpha.channel(0));
  return alpha;
}

// Random stream for one purpose and view, so that defects do not influence each other.
Random RandomOf(std::string_view name, std::string_view purpose, uint64_t seed) {
  return Random(StableHash(Cat(purpose, " ", name), seed));
}

Status MakeEmptyFolder(const fs::path& path) {
  std::error_code code;
  fs::remove_all(path, code);
  if (!code) fs::create_directories(path, code);
  if (code) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot create this folder: ", code.message())};
  return {};
}

Status CopyFile(const fs::path& from, const fs::path& to) {
  std::error_code code;
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, code);
  if (code) return Error{ErrorCode::kIo, Cat(to.string(), ": cannot copy ", from.string(), ": ", code.message())};
  return {};
}

}  // namespace

Status Validate(const PictureDefects& d) {
  const auto bad = [](std::string sentence) { return Error{ErrorCode::kBadArgument, std::move(sentence)}; };
  if (!(d.noise >= 0 && d.noise <= 255)) return bad(Cat("noise must be 0 to 255, not ", d.noise));
  if (d.jpeg < 0 || d.jpeg > 100) return bad(Cat("jpeg must be a quality from 1 to 100, or 0 for none, not ", d.jpeg));
  if (!(d.exposure >= 0 && d.exposure <= 1))
    return bad(Cat("exposure must be a fraction from 0 to 1, not ", d.exposure));
  for (const auto& [name, value] : {std::pair("pose", d.pose), {"mask", d.mask}, {"defocus", d.defocus}}) {
    if (!(value >= 0 && value <= kMostPixels))
      return bad(Cat(name, " must be 0 to ", kMostPixels, " pixels, not ", value));
  }
  return {};
}

Result<Image> WithDefects(const Image& picture, const PictureDefects& defects, const std::array<float, 3>& background,
                          std::string_view name, uint64_t seed) {
  Image photo = CompositeOver(picture, background), alpha = AlphaOf(picture);
  if (defects.defocus > 0) {
    photo = Blurred(photo, defects.defocus);
    alpha = Blurred(alpha, defects.defocus);
  }
  if (defects.exposure > 0) {
    const double factor = 1 + defects.exposure * RandomOf(name, "exposure", seed).Uniform(-1, 1);
    for (float& x : photo.pixels) x = std::min(1.0f, x * static_cast<float>(factor));
  }
  if (defects.noise > 0) {
    Random random = RandomOf(name, "noise", seed);
    for (float& x : photo.pixels) {
      x = std::clamp(x + static_cast<float>(defects.noise / 255 * random.Normal()), 0.0f, 1.0f);
    }
  }
  if (defects.jpeg > 0) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, EncodeJpeg(photo, defects.jpeg));
    ANCHORSPLAT_ASSIGN_OR_RETURN(photo, DecodeJpegBytes(bytes, "a photograph"));
  }
  const bool cut = defects.mask > 0;
  if (cut) alpha = Eroded(alpha, defects.mask);
  for (int c = 0; c < 3; ++c) {
    float* values = photo.channel(c);
    for (int64_t i = 0; i < photo.plane(); ++i) {
      const float a = alpha.pixels[static_cast<size_t>(i)];
      if (cut ? a < 0.5f : !(a > 1e-3f)) values[i] = background[static_cast<size_t>(c)];
    }
  }
  return photo;
}

Camera WithWrongAim(const Camera& camera, const PictureDefects& defects, uint64_t seed) {
  if (!(defects.pose > 0)) return camera;
  const double phi = 2 * std::numbers::pi * RandomOf(camera.name, "pose", seed).Uniform();
  const double angle = std::atan(defects.pose / camera.intrinsics.fx);
  // Rodrigues' formula for an axis in the picture plane.
  const double x = std::cos(phi), y = std::sin(phi), c = std::cos(angle), s = std::sin(angle);
  const std::array<double, 9> turn = {c + x * x * (1 - c),
                                      x * y * (1 - c),
                                      y * s,  //
                                      x * y * (1 - c),
                                      c + y * y * (1 - c),
                                      -x * s,  //
                                      -y * s,
                                      x * s,
                                      c};
  Camera out = camera;
  const Pose& from = camera.world_to_camera;
  for (size_t i = 0; i < 3; ++i) {
    double t = 0;
    for (size_t k = 0; k < 3; ++k) {
      double r = 0;
      for (size_t j = 0; j < 3; ++j) r += turn[3 * i + j] * from.rotation[3 * j + k];
      out.world_to_camera.rotation[3 * i + k] = r;
      t += turn[3 * i + k] * from.translation[k];
    }
    out.world_to_camera.translation[i] = t;
  }
  return out;
}

Status WriteCapturedProject(const fs::path& low, const fs::path& to, const PictureDefects& defects,
                            const std::array<float, 3>& background, int hold_out, uint64_t seed) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(defects));
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet cameras, ReadCameras(low / "sparse" / "0"));
  // Order in which fits count held-out views.
  std::stable_sort(cameras.cameras.begin(), cameras.cameras.end(),
                   [](const Camera& a, const Camera& b) { return a.name < b.name; });
  const fs::path images = to / "images", sparse = to / "sparse" / "0";
  ANCHORSPLAT_RETURN_IF_ERROR(MakeEmptyFolder(to));
  ANCHORSPLAT_RETURN_IF_ERROR(MakeEmptyFolder(images));
  ANCHORSPLAT_RETURN_IF_ERROR(MakeEmptyFolder(sparse));
  const auto photograph = [&](int64_t i) -> Status {
    Camera& camera = cameras.cameras[static_cast<size_t>(i)];
    if (camera.image.empty()) {
      return Error{ErrorCode::kNotFound, Cat((low / "images").string(), ": picture ", camera.name, " is missing")};
    }
    const bool held_out = hold_out > 0 && i % hold_out == 0;
    const fs::path source = camera.image;
    if (held_out || !defects.InPictures()) {
      ANCHORSPLAT_RETURN_IF_ERROR(CopyFile(source, images / source.filename()));
    } else {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const Image picture, ReadImage(source));
      ANCHORSPLAT_ASSIGN_OR_RETURN(const Image photo, WithDefects(picture, defects, background, camera.name, seed));
      const fs::path target = images / source.filename().replace_extension(".png");
      ANCHORSPLAT_RETURN_IF_ERROR(WritePng(target, photo, {.overwrite = true}));
      camera.image = target;
    }
    if (!held_out) camera = WithWrongAim(camera, defects, seed);
    return {};
  };
  std::mutex mutex;
  Status failed;
  ParallelFor(0, std::ssize(cameras.cameras), 1, [&](int64_t i, int64_t) {
    const Status status = photograph(i);
    const std::lock_guard<std::mutex> lock(mutex);
    if (!status.ok() && failed.ok()) failed = status;
  });
  ANCHORSPLAT_RETURN_IF_ERROR(failed);
  ANCHORSPLAT_RETURN_IF_ERROR(WriteColmapCameras(sparse, cameras, ColmapForm::kBinary, {.overwrite = true}));
  return CopyFile(low / "sparse" / "0" / "points3D.bin", sparse / "points3D.bin");
}

}  // namespace anchorsplat

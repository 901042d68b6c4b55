#include "train/true_views.h"

#include <algorithm>
#include <charconv>
#include <system_error>

#include "core/text.h"
#include "dataset/object_name.h"
#include "formats/image_io.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// What tells two objects of one name apart: where they are and how their views are made.
std::string FolderName(const SceneEntry& entry, const Scene& scene) {
  std::error_code ignored;
  const fs::path mesh = entry.folder / kMeshName;
  std::string identity = fs::weakly_canonical(entry.folder, ignored).string();
  identity += Cat(" ", fs::file_size(mesh, ignored), " ", scene.high_views().size());
  if (!scene.high_views().empty()) identity += Cat(" ", scene.high_views()[0].intrinsics.width);
  const uint64_t hash = StableHash(identity);
  std::string digits;
  for (int shift = 28; shift >= 0; shift -= 4) digits += "0123456789abcdef"[(hash >> shift) & 15];
  return entry.name + "-" + digits;
}

Image Part(const Image& image, const PixelBox& box) {
  Image part(box.x1 - box.x0, box.y1 - box.y0, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = box.y0; y < box.y1; ++y) {
      const float* row = image.channel(c) + int64_t{y} * image.width;
      std::copy(row + box.x0, row + box.x1, part.channel(c) + int64_t{y - box.y0} * part.width);
    }
  }
  return part;
}

// "012_100_200.png" of view "012": where its left upper corner lies.
bool ParseCorner(std::string_view text, int& x, int& y) {
  const char* end = text.data() + text.size();
  const auto [middle, code] = std::from_chars(text.data(), end, x);
  if (code != std::errc() || middle == end || *middle != '_') return false;
  const auto [stop, code2] = std::from_chars(middle + 1, end, y);
  return code2 == std::errc() && stop == end && x >= 0 && y >= 0;
}

}  // namespace

PixelBox ObjectBox(const Image& picture, const std::array<float, 3>& background) {
  PixelBox box = {picture.width, picture.height, 0, 0};
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      bool shown = false;
      if (picture.channels == 4) {
        shown = picture.at(3, y, x) > 0;
      } else {
        for (int c = 0; c < 3; ++c) shown |= picture.at(c, y, x) != background[static_cast<size_t>(c)];
      }
      if (!shown) continue;
      box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
    }
  }
  return box.empty() ? PixelBox{} : box;
}

TrueViews::TrueViews(SceneEntry entry, const Scene& scene, const fs::path& cache)
    : entry_(std::move(entry)), folder_(cache / FolderName(entry_, scene)), background_(scene.background()) {
  for (const Camera& camera : scene.high_views()) {
    stored_.push_back(camera.image);
    names_.push_back(fs::path(camera.name).filename().string());
    width_ = camera.intrinsics.width;
    height_ = camera.intrinsics.height;
  }
}

Result<TrueView> TrueViews::Unpack(const Image& part, int x0, int y0) const {
  TrueView view;
  view.background = background_;
  view.object = {x0, y0, x0 + part.width, y0 + part.height};
  view.picture = Image(width_, height_, 3);
  for (int c = 0; c < 3; ++c) {
    const float behind = background_[static_cast<size_t>(c)];
    std::fill(view.picture.channel(c), view.picture.channel(c) + view.picture.plane(), behind);
    for (int y = 0; y < part.height; ++y) {
      const float* in = part.channel(c) + int64_t{y} * part.width;
      const float* alpha = part.channels == 4 ? part.channel(3) + int64_t{y} * part.width : nullptr;
      float* out = view.picture.channel(c) + int64_t{y0 + y} * width_ + x0;
      for (int x = 0; x < part.width; ++x) {
        out[x] = alpha == nullptr ? in[x] : in[x] * alpha[x] + behind * (1 - alpha[x]);
      }
    }
  }
  return view;
}

Result<TrueView> TrueViews::Load(size_t view) const {
  const auto whole = [&](const Image& picture) -> Result<TrueView> {
    PixelBox box = ObjectBox(picture, background_);
    ANCHORSPLAT_ASSIGN_OR_RETURN(TrueView result, Unpack(picture, 0, 0));
    result.object = box;
    return result;
  };
  if (!stored_.at(view).empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image picture, ReadImage(stored_[view]));
    if (picture.width != width_ || picture.height != height_) {
      return Error{ErrorCode::kBadFile, Cat(stored_[view].string(), ": has ", picture.width, " x ", picture.height,
                                            " pixels, its camera ", width_, " x ", height_)};
    }
    return whole(picture);
  }
  const std::string prefix = names_[view] + "_";
  std::error_code code;
  for (fs::directory_iterator it(folder_, code), end; !code && it != end; it.increment(code)) {
    const std::string name = it->path().stem().string();
    int x = 0, y = 0;
    if (!name.starts_with(prefix) || !ParseCorner(std::string_view(name).substr(prefix.size()), x, y)) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image part, ReadImage(it->path()));
    if (part.width > width_ - x || part.height > height_ - y) {
      return Error{ErrorCode::kBadFile, Cat(it->path().string(), ": reaches out of its view; remove the folder ",
                                            folder_.string(), " to have it made again")};
    }
    return Unpack(part, x, y);
  }
  // The mesh and what is made of it for rays leave the memory again: with many objects it would not hold them all.
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Scene scene, Scene::Open(entry_));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image picture, scene.HighPicture(view));
  PixelBox box = ObjectBox(picture, background_);
  if (box.empty()) box = {0, 0, 1, 1};
  fs::create_directories(folder_, code);
  ANCHORSPLAT_RETURN_IF_ERROR(
      WritePng(folder_ / Cat(prefix, box.x0, "_", box.y0, ".png"), Part(picture, box), {.overwrite = true}));
  return whole(picture);
}

}  // namespace anchorsplat

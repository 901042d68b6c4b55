#include "train/true_views.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <system_error>

#include "core/text.h"
#include "dataset/object_name.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Distinguishes objects of equal name: by location and by how their views are made.
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

Image CutOut(const Image& image, const PixelBox& box) {
  Image part(box.x1 - box.x0, box.y1 - box.y0, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = box.y0; y < box.y1; ++y) {
      const float* row = image.channel(c) + int64_t{y} * image.width;
      std::copy(row + box.x0, row + box.x1, part.channel(c) + int64_t{y - box.y0} * part.width);
    }
  }
  return part;
}

// Parses "012_100_200.png" of view "012": position of its upper left corner.
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
    sizes_.push_back({camera.intrinsics.width, camera.intrinsics.height});
  }
  kept_.resize(names_.size());
}

TrueViews::TrueViews(const std::vector<Camera>& views, std::function<Result<ViewPicture>(size_t view)> picture)
    : photograph_(std::move(picture)), kept_(views.size()) {
  for (const Camera& camera : views) sizes_.push_back({camera.intrinsics.width, camera.intrinsics.height});
}

// 8 bits a channel, [y][x][c].
struct TrueViews::Kept {
  PixelBox box;
  int channels = 0;
  std::vector<uint8_t> values;
  Buffer<uint8_t> ignored;  // as Part's
};

namespace {

// Composites a part over the background; `window` and the part's box are in view pixels, value(c, y, x) in the part's.
template <typename Value>
TrueView Compose(const PixelBox& window, const PixelBox& box, int channels, const Buffer<uint8_t>& ignored,
                 const std::array<float, 3>& background, Value&& value) {
  TrueView view;
  view.background = background;
  view.picture = Image(window.x1 - window.x0, window.y1 - window.y0, 3);
  PixelBox inside = {std::max(box.x0, window.x0), std::max(box.y0, window.y0), std::min(box.x1, window.x1),
                     std::min(box.y1, window.y1)};
  if (inside.empty()) inside = {};
  for (int c = 0; c < 3; ++c) {
    const float behind = background[static_cast<size_t>(c)];
    std::fill(view.picture.channel(c), view.picture.channel(c) + view.picture.plane(), behind);
    for (int y = inside.y0; y < inside.y1; ++y) {
      float* out = view.picture.channel(c) + int64_t{y - window.y0} * view.picture.width - window.x0;
      for (int x = inside.x0; x < inside.x1; ++x) {
        const float shown = value(c, y - box.y0, x - box.x0);
        if (channels == 4) {
          const float alpha = value(3, y - box.y0, x - box.x0);
          out[x] = shown * alpha + behind * (1 - alpha);
        } else {
          out[x] = shown;
        }
      }
    }
  }
  if (!ignored.empty()) {
    view.ignored.resize(static_cast<size_t>(view.picture.plane()));
    for (int y = inside.y0; y < inside.y1; ++y) {
      const uint8_t* from = ignored.data() + int64_t{y - box.y0} * (box.x1 - box.x0) + inside.x0 - box.x0;
      std::copy(from, from + (inside.x1 - inside.x0),
                view.ignored.data() + int64_t{y - window.y0} * view.picture.width + inside.x0 - window.x0);
    }
  }
  if (!inside.empty()) {
    view.object = {inside.x0 - window.x0, inside.y0 - window.y0, inside.x1 - window.x0, inside.y1 - window.y0};
  }
  return view;
}

}  // namespace

Result<TrueViews::Part> TrueViews::Read(size_t view) const {
  const auto [width, height] = sizes_.at(view);
  if (photograph_) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(ViewPicture picture, photograph_(view));
    return Part{std::move(picture.image), {0, 0, width, height}, std::move(picture.ignored)};
  }
  if (!stored_.at(view).empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image picture, ReadImage(stored_[view]));
    if (picture.width != width || picture.height != height) {
      return Error{ErrorCode::kBadFile, Cat(stored_[view].string(), ": has ", picture.width, " x ", picture.height,
                                            " pixels, its camera ", width, " x ", height)};
    }
    const PixelBox box = ObjectBox(picture, background_);
    return Part{CutOut(picture, box), box, {}};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(Make({&view, 1}));
  const auto file = Find(view);
  if (!file) return Error{ErrorCode::kIo, Cat(folder_.string(), ": view ", names_[view], " has disappeared")};
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image part, ReadImage(file->path));
  if (part.width > width - file->x || part.height > height - file->y) {
    return Error{ErrorCode::kBadFile, Cat(file->path.string(), ": does not fit its view. Remove the folder ",
                                          folder_.string(), " to rebuild it")};
  }
  const PixelBox box = {file->x, file->y, file->x + part.width, file->y + part.height};
  return Part{std::move(part), box, {}};
}

std::optional<TrueViews::File> TrueViews::Find(size_t view) const {
  const std::string prefix = names_[view] + "_";
  std::error_code code;
  for (fs::directory_iterator it(folder_, code), end; !code && it != end; it.increment(code)) {
    const std::string name = it->path().stem().string();
    File file{it->path(), 0, 0};
    if (name.starts_with(prefix) && ParseCorner(std::string_view(name).substr(prefix.size()), file.x, file.y)) {
      return file;
    }
  }
  return std::nullopt;
}

Status TrueViews::Make(std::span<const size_t> views) const {
  if (photograph_) return {};
  // The mesh and what is made of it for rays leave the memory again: with many objects it would not hold them all.
  std::optional<Scene> scene;
  for (const size_t view : views) {
    if (!stored_.at(view).empty() || Find(view)) continue;
    if (!scene) {
      auto opened = Scene::Open(entry_);
      if (!opened.ok()) return opened.error();
      scene = *std::move(opened);
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image picture, scene->HighPicture(view));
    PixelBox box = ObjectBox(picture, background_);
    if (box.empty()) box = {0, 0, 1, 1};
    std::error_code code;
    fs::create_directories(folder_, code);
    ANCHORSPLAT_RETURN_IF_ERROR(WritePng(folder_ / Cat(names_[view], "_", box.x0, "_", box.y0, ".png"),
                                         CutOut(picture, box), {.overwrite = true}));
  }
  return {};
}

Result<TrueView> TrueViews::Load(size_t view) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Part part, Read(view));
  const Image& picture = part.picture;
  const auto [width, height] = sizes_.at(view);
  return Compose({0, 0, width, height}, part.box, picture.channels, part.ignored, background_,
                 [&](int c, int y, int x) { return picture.at(c, y, x); });
}

Result<std::shared_ptr<const TrueViews::Kept>> TrueViews::Keep(size_t view) const {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (kept_[view]) return kept_[view];
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(Part part, Read(view));
  const auto kept = std::make_shared<Kept>();
  kept->box = part.box;
  kept->channels = part.picture.channels;
  kept->ignored = std::move(part.ignored);
  kept->values.reserve(part.picture.pixels.size());
  for (int y = 0; y < part.picture.height; ++y) {
    for (int x = 0; x < part.picture.width; ++x) {
      for (int c = 0; c < kept->channels; ++c) {
        kept->values.push_back(
            static_cast<uint8_t>(std::lround(std::clamp(part.picture.at(c, y, x), 0.0f, 1.0f) * 255)));
      }
    }
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  kept_[view] = kept;
  return std::shared_ptr<const Kept>(kept);
}

Result<TrueView> TrueViews::LoadWindow(size_t view, const PixelBox& window) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::shared_ptr<const Kept> kept, Keep(view));
  const int64_t width = kept->box.x1 - kept->box.x0, channels = kept->channels;
  return Compose(window, kept->box, kept->channels, kept->ignored, background_, [&](int c, int y, int x) {
    return static_cast<float>(kept->values[static_cast<size_t>((y * width + x) * channels + c)]) / 255.0f;
  });
}

Result<PixelBox> TrueViews::Box(size_t view) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::shared_ptr<const Kept> kept, Keep(view));
  return kept->box;
}

}  // namespace anchorsplat

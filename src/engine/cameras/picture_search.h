#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/camera.h"

namespace anchorsplat {

// Where to search for the images of a camera file.
struct PicturePlaces {
  std::vector<std::filesystem::path> folders;  // that the file's paths are relative to, likeliest first
  std::filesystem::path project;               // searched recursively otherwise; empty: not
  bool originals = false;                      // prefer originals over undistorted images beside them
  bool masks = false;                          // search for masks
  bool complete = false;                       // the file should name all images, so report others
};

// Result for a path in a camera file.
struct FoundPicture {
  std::string name;            // view name: path relative to the file's other images, with '/', without extension
  std::filesystem::path file;  // the image; if not found, the first path tried
  std::filesystem::path mask;  // its mask; empty if there is none
  std::string ambiguity;       // message that names two equally likely images, in which case none is taken
};

// Finds the images that a camera file names, in its order. Paths may come from another machine: '\' is '/', "%20" a
// space, and letter case and image type may differ (.JPG, .jpeg, .png, none). All paths with one folder are resolved to
// one folder: the given one; else, below `project`, one that contains these names and shares the longest path suffix,
// then `images`, `input`, others (`images_2` last). Masks, depth maps and our renderings in unusual folders are not
// photographs. Images found are recorded as inputs, except our own renderings, which are recorded when opened. With
// `complete`, a message reports images beside them that no name means.
std::vector<FoundPicture> FindPictures(const PicturePlaces& places, std::span<const std::string> names);

// The same for cameras whose `image` is the path in the file: sets names, images and masks. A missing image becomes the
// first path tried.
void FindPicturesOf(const PicturePlaces& places, std::span<Camera> cameras);

// While open, collects ambiguities that FindPictures meets on this thread, through any reader: an error for callers
// that need images, ignored by those that need only cameras.
class AmbiguousPictures {
 public:
  AmbiguousPictures();
  ~AmbiguousPictures();
  AmbiguousPictures(const AmbiguousPictures&) = delete;
  AmbiguousPictures& operator=(const AmbiguousPictures&) = delete;

  const std::string& first() const { return first_; }  // message; empty: none

 private:
  friend std::vector<FoundPicture> FindPictures(const PicturePlaces& places, std::span<const std::string> names);

  AmbiguousPictures* outer_;
  std::string first_;
};

// The project folder of a file or model: above folders named sparse, colmap, 0, dense and the like.
std::filesystem::path ProjectAbove(const std::filesystem::path& folder);

}  // namespace anchorsplat

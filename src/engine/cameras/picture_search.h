#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/camera.h"

namespace anchorsplat {

// Where the pictures of a camera file may lie.
struct PicturePlaces {
  std::vector<std::filesystem::path> folders;  // that the file's paths begin in, the likeliest first
  std::filesystem::path project;               // below which they are searched otherwise; empty: nowhere
  bool originals = false;  // whether they are as the camera took them, where undistorted ones may lie beside them
  bool masks = false;      // what is looked for are masks
  bool complete = false;   // whether the file is meant to name all pictures, so that others are worth a word
};

// What became of a path in a camera file.
struct FoundPicture {
  std::string name;            // of the view: below the file's other pictures, with '/', without a picture's extension
  std::filesystem::path file;  // the picture; where there is none, the first path that was tried
  std::filesystem::path mask;  // of it; empty where there is none
  std::string unclear;         // why there is none where two are as likely: a message that names both
};

// The pictures that a camera file names, in its order. Paths may be another machine's: '\' is '/', "%20" a space, the
// case of letters and the kind of picture may differ (.JPG, .jpeg, .png, none). A folder of the file is one folder
// here: the one that it says; else, below `project`, the one that has pictures of these names and the longest end of
// its path in common, then `images`, `input`, others (`images_2` last; masks, depth maps and what this program rendered
// into any other folder are no photographs). Pictures that are found are recorded as inputs, but for our own
// renderings, which are inputs of who opens them. With `complete`, one message tells of pictures beside them that no
// name means.
std::vector<FoundPicture> FindPictures(const PicturePlaces& places, std::span<const std::string> names);

// The same for cameras whose `image` is the path in the file: sets their names, pictures and masks. The picture of a
// camera without one is where it was looked for first.
void FindPicturesOf(const PicturePlaces& places, std::span<Camera> cameras);

// Keeps what FindPictures finds unclear on this thread while this is open, below whatever reader asks it: an error for
// who needs the pictures, nothing for who needs the cameras alone.
class UnclearPictures {
 public:
  UnclearPictures();
  ~UnclearPictures();
  UnclearPictures(const UnclearPictures&) = delete;
  UnclearPictures& operator=(const UnclearPictures&) = delete;

  const std::string& first() const { return first_; }  // message; empty: all is clear

 private:
  friend std::vector<FoundPicture> FindPictures(const PicturePlaces& places, std::span<const std::string> names);

  UnclearPictures* outer_;
  std::string first_;
};

// The project's folder of a file or a model in it: above folders called sparse, colmap, 0, dense and the like.
std::filesystem::path ProjectAbove(const std::filesystem::path& folder);

}  // namespace anchorsplat

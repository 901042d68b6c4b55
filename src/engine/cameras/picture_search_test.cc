#include "cameras/picture_search.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "core/messages_for_test.h"
#include "images/rendering.h"
#include "io/folder_for_test.h"
#include "io/input_record.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

void Put(const fs::path& path) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << "x";
}

FoundPicture FindOne(const PicturePlaces& places, const std::string& name) {
  const std::vector<std::string> names = {name};
  FoundPicture found = FindPictures(places, names).at(0);
  EXPECT_EQ(found.ambiguity, "");
  return found;
}

TEST(FindPictures, NamesOfOtherMachines) {
  const TestFolder folder;
  const fs::path project = folder / "thing";
  Put(project / "images/0001.png");
  Put(project / "images_4/0001.png");
  Put(project / "masks/0001.png");
  Put(project / "depth/0001.png");
  Put(project / "test/ours_30000/gt/0001.png");
  const PicturePlaces places{.folders = {project}, .project = project};
  for (const char* name :
       {"images/0001.png", "./images/0001.png", "images\\0001.png", ".\\images\\0001.png", "images/0001", "0001.png",
        "C:\\Users\\somebody\\thing\\images\\0001.png", "/home/somebody/thing/images/0001.png", "IMAGES/0001.PNG",
        "images/0001.JPG", "images/%30001.png", "file:///C:/data/images/0001.png", "somewhere/else/0001.jpeg"}) {
    const FoundPicture found = FindOne(places, name);
    EXPECT_EQ(found.file, project / "images/0001.png") << name;
    EXPECT_EQ(found.mask, project / "masks/0001.png") << name;
    EXPECT_EQ(found.name.find_first_of("\\:%"), std::string::npos) << name << " is called " << found.name;
    EXPECT_FALSE(found.name.starts_with('/')) << found.name;
  }
  EXPECT_EQ(FindOne(places, "images_4/0001.png").file, project / "images_4/0001.png");
  const FoundPicture missing = FindOne(places, "images/0002.png");
  EXPECT_EQ(missing.file, project / "images/0002.png") << "where it was looked for";
  EXPECT_FALSE(fs::exists(missing.file));
}

TEST(FindPictures, WhereAnyPersonWouldLook) {
  for (const char* place : {"input", "rgb", "photos", "images_2", "data/scan/left", ""}) {
    const TestFolder folder;
    Put(folder / "masks/a.png");
    Put(folder / place / "a.JPG");
    const Messages messages;
    EXPECT_EQ(FindOne({.folders = {folder / "images"}, .project = folder.path()}, "a.jpg").file,
              (folder / place / "a.JPG").lexically_normal())
        << place;
  }
  // INRIA's convert.py: the distorted model is that of the pictures as they were taken.
  const TestFolder folder;
  Put(folder / "input/a.jpg");
  Put(folder / "images/a.jpg");
  PicturePlaces places{.folders = {}, .project = folder.path()};
  EXPECT_EQ(FindOne(places, "a.jpg").file, folder / "images/a.jpg");
  places.originals = true;
  EXPECT_EQ(FindOne(places, "a.jpg").file, folder / "input/a.jpg");
}

TEST(FindPictures, RigsKeepTheirFolders) {
  const TestFolder folder;
  std::vector<std::string> names, windows;
  for (const char* name : {"cam0/0000", "cam1/0000", "cam1/0001"}) {
    Put(folder / "images" / (std::string(name) + ".png"));
    names.push_back(std::string(name) + ".PNG");
    windows.push_back("D:\\rig\\pictures\\" + std::string(name) + ".png");
    std::ranges::replace(windows.back(), '/', '\\');
  }
  for (const auto& given : {names, windows}) {
    const auto found = FindPictures({.folders = {folder.path()}, .project = folder.path()}, given);
    EXPECT_EQ(found[1].name, "cam1/0000");
    EXPECT_EQ(found[0].file, folder / "images/cam0/0000.png");
    EXPECT_EQ(found[1].file, folder / "images/cam1/0000.png");
    EXPECT_EQ(found[2].file, folder / "images/cam1/0001.png");
  }
}

// What is not among its neighbours is missing: a file of that name elsewhere is another one.
TEST(FindPictures, OneMissingPictureIsNotTakenFromElsewhere) {
  const TestFolder folder;
  Put(folder / "images/0000.png");
  Put(folder / "renders/0001.png");
  const std::vector<std::string> names = {"images/0000.png", "images/0001.png"};
  const auto found = FindPictures({.folders = {folder.path()}, .project = folder.path()}, names);
  EXPECT_EQ(found[1].file, folder / "images/0001.png");
}

TEST(FindPictures, WhatIsAmbiguousNamesBoth) {
  const TestFolder folder;
  Put(folder / "left/a.png");
  Put(folder / "right/a.png");
  const PicturePlaces places{.folders = {folder.path()}, .project = folder.path()};
  std::vector<std::string> names = {"/elsewhere/a.png"};
  auto found = FindPictures(places, names);
  EXPECT_FALSE(fs::exists(found[0].file));
  for (const char* place : {"left", "right"}) {
    EXPECT_NE(found[0].ambiguity.find((folder / place).string()), std::string::npos) << found[0].ambiguity;
  }
  {
    const AmbiguousPictures ambiguous;
    (void)FindPictures(places, names);
    EXPECT_EQ(ambiguous.first(), found[0].ambiguity);
  }
  EXPECT_EQ(FindOne(places, "/elsewhere/right/a.png").file, folder / "right/a.png");
  Put(folder / "left/b.jpg");
  Put(folder / "left/b.webp");
  names = {"left/b.png"};
  found = FindPictures(places, names);
  for (const char* name : {"b.jpg", "b.webp"}) {
    EXPECT_NE(found[0].ambiguity.find(name), std::string::npos) << found[0].ambiguity;
  }
  EXPECT_EQ(FindOne(places, "left/b.jpeg").file, folder / "left/b.jpg");
  Put(folder / "left/b.png");
  EXPECT_EQ(FindOne(places, "left/b").file, folder / "left/b.png") << "as NeRF's files mean it";
}

TEST(FindPictures, WhatWeRenderedIsNoPhotograph) {
  const TestFolder folder;
  const auto render = [&](const std::string& place) {
    fs::create_directories(folder / place);
    ASSERT_TRUE(WriteRendering(folder / place / "a.png", Image(2, 2, 3), {.overwrite = true}).ok());
  };
  const PicturePlaces places{.folders = {folder.path()}, .project = folder.path()};
  const InputRecord record;
  render("before");
  render("after/cam0");
  EXPECT_EQ(FindOne(places, "a.png").file, folder / "a.png") << "where it was looked for";
  EXPECT_EQ(FindOne(places, "cam0/a.png").file, folder / "cam0/a.png");
  Put(folder / "photographs/a.png");
  EXPECT_EQ(FindOne(places, "a.png").file, folder / "photographs/a.png");
  EXPECT_FALSE(CheckNotInput(folder / "photographs/a.png").ok());
  // Where everybody has pictures, and where the file says, they may be what is trained on; until then they may be
  // rendered again.
  render("images");
  for (const char* place : {"images/a.png", "before/a.png"}) {
    EXPECT_EQ(FindOne(places, place).file, folder / place);
    EXPECT_TRUE(CheckNotInput(folder / place).ok()) << place;
  }
  EXPECT_EQ(FindOne(places, "a.png").file, folder / "images/a.png");
}

TEST(FindPictures, NamesFromMacs) {
  const TestFolder folder;
  Put(folder / "images/u\u0308ni\u0308 0.PNG");
  Put(folder / "images/\u00E9.png");
  const PicturePlaces places{.folders = {folder.path()}, .project = folder.path()};
  EXPECT_EQ(FindOne(places, "images/\u00FCn\u00EF 0.png").file, folder / "images/u\u0308ni\u0308 0.PNG");
  EXPECT_EQ(FindOne(places, "elsewhere/e\u0301.jpg").file, folder / "images/\u00E9.png");
}

TEST(FindPictures, LinksInCirclesAndStrangeNames) {
  const TestFolder folder;
  Put(folder / "images/we\\ird%20.png");
  Put(folder / "images/a b.png");
  fs::create_directory_symlink(folder.path(), folder / "images/again");
  const PicturePlaces places{.folders = {folder / "images"}, .project = folder.path()};
  EXPECT_EQ(FindOne(places, "we\\ird%20.png").file, folder / "images/we\\ird%20.png");
  EXPECT_EQ(FindOne(places, "x:/y/a%20b.png").file, folder / "images/a b.png");
  for (const char* name : {"", "/", "..", "../..", "%", "%00", "a/../../..//b", "C:", "C:\\", "file://", ".png"}) {
    EXPECT_FALSE(fs::is_regular_file(FindOne(places, name).file)) << name;
  }
  EXPECT_EQ(FindOne(places, "../../../a b").name, "a b");
}

TEST(FindPictures, TellsOfPicturesWithoutACamera) {
  const TestFolder folder;
  for (const char* name : {"a.png", "b.png", "c.png", "a_depth.png", "notes.txt"}) Put(folder / "images" / name);
  const Messages messages;
  (void)FindOne({.folders = {folder / "images"}, .project = folder.path(), .complete = true}, "a.png");
  ASSERT_EQ(messages.warnings().size(), 1u);
  EXPECT_NE(messages.warnings()[0].find("2 of 3 pictures have no camera"), std::string::npos) << messages.warnings()[0];
}

TEST(ProjectAbove, IsWhereTheModelsFoldersEnd) {
  for (const char* folder : {"p/scene/sparse/0", "p/scene/sparse", "p/scene/colmap/sparse/0", "p/scene/sparse_txt",
                             "p/scene/distorted/sparse/0", "p/scene/dense/sparse", "p/scene", "p/scene/"}) {
    EXPECT_EQ(ProjectAbove(folder), "p/scene") << folder;
  }
  EXPECT_EQ(ProjectAbove("/0"), "/");
}

}  // namespace
}  // namespace anchorsplat

#include "dataset/unfinished_objects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/text.h"
#include "dataset/object_builder.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;

std::vector<std::string> Found(const fs::path& dataset, const std::vector<ObjectFailure>& failures) {
  const auto objects = FindUnfinished(dataset, failures);
  EXPECT_TRUE(objects.ok());
  std::vector<std::string> texts;
  for (const UnfinishedObject& o : *objects) {
    texts.push_back(Cat(o.name, o.listed ? " listed" : "", o.folder.empty() ? "" : " begun"));
  }
  return texts;
}

TEST(UnfinishedObjects, AreThoseOfTheListAndThoseBegun) {
  const TestFolder folder;
  EXPECT_THAT(Found(folder.path(), {}), ElementsAre());
  fs::create_directories(BuildingFolder(folder.path(), "b"));
  fs::create_directories(BuildingFolder(folder.path(), "c"));
  fs::create_directories(BuildingFolder(folder.path(), "d"));
  ASSERT_TRUE(WriteUnfinished(folder.path(), {"b", "a", "e"}).ok());
  const std::vector<ObjectFailure> failures = {{"d", "d.obj", "mesh", "broken"}, {"e", "e.obj", "mesh", "broken"}};
  EXPECT_THAT(Found(folder.path(), failures), ElementsAre("a listed", "b listed begun", "c begun"));
  ASSERT_TRUE(WriteUnfinished(folder.path(), {}).ok());
  EXPECT_THAT(Found(folder.path(), failures), ElementsAre("b begun", "c begun"));
  ASSERT_TRUE(WriteUnfinished(folder.path(), {}).ok()) << "twice is no error";
}

}  // namespace
}  // namespace anchorsplat

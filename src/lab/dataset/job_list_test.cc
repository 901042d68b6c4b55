#include "dataset/job_list.h"

#include <gtest/gtest.h>

#include <fstream>

#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

std::map<std::string, std::string> NamesOf(const JobList& list) {
  std::map<std::string, std::string> names;  // by mesh
  for (const ObjectJob& job : list.jobs) names[job.source] = job.name;
  return names;
}

std::map<std::string, std::string> Names(const std::vector<std::string>& meshes, const Manifest& there = {}) {
  return NamesOf(ListJobs(meshes, SingleRecipe({}), there, {}));
}

TEST(JobList, MeshesOfOneNameAreCalledAfterTheirFolders) {
  const auto names = Names({"m/table/model.obj", "m/chair/model.obj", "m/lamp.obj", "m/lamp.obj"});
  EXPECT_EQ(names,
            (std::map<std::string, std::string>{
                {"m/chair/model.obj", "chair-model"}, {"m/table/model.obj", "table-model"}, {"m/lamp.obj", "lamp"}}));
}

TEST(JobList, FoldersOfOneNameAreNumberedWhateverTheOrder) {
  auto names = Names({"b/x/model.obj", "a/x/model.obj", "x-model.glb"});
  EXPECT_EQ(names.size(), 3u);
  EXPECT_EQ(names.at("x-model.glb"), "x-model");  // the only one that asks for it
  EXPECT_EQ(names.at("a/x/model.obj"), "x-model-2");
  EXPECT_EQ(names.at("b/x/model.obj"), "x-model-3");
  EXPECT_EQ(names, Names({"x-model.glb", "a/x/model.obj", "b/x/model.obj"}));
  names = Names({"model.obj", "model.glb"});  // without folders
  EXPECT_EQ(names.at("model.glb"), "model");
  EXPECT_EQ(names.at("model.obj"), "model-2");
}

TEST(JobList, ObjectsThatAreThereKeepTheirNames) {
  Manifest there;
  there["model"].source = "chair/model.obj";
  const auto names = Names({"chair/model.obj", "table/model.obj"}, there);
  EXPECT_EQ(names.at("chair/model.obj"), "model");
  EXPECT_EQ(names.at("table/model.obj"), "table-model");
  Recipe recipe = SingleRecipe({});
  recipe.entries.push_back(recipe.entries[0]);
  recipe.entries[0].name = "long";
  recipe.entries[1].name = "short";
  recipe.draws = 2;
  Manifest pairs;
  for (const std::string name : {"model--long", "model--short"}) pairs[name].source = "chair/model.obj";
  const JobList list = ListJobs({"chair/model.obj", "table/model.obj"}, recipe, pairs, {});
  std::vector<std::string> drawn;
  for (const ObjectJob& job : list.jobs) drawn.push_back(job.name);
  EXPECT_EQ(drawn,
            (std::vector<std::string>{"model--long", "model--short", "table-model--long", "table-model--short"}));
}

TEST(JobList, ALibraryThatCannotBeReadIsAFailureAndTheOthersGoOn) {
  const TestFolder folder;
  std::ofstream(folder / "bad.sh3f") << "no archive";
  const std::string bad = (folder / "bad.sh3f").string(), none = (folder / "none.sh3f").string();
  const JobList list = ListJobs({bad, "chair.obj", none}, SingleRecipe({}), {}, {});
  ASSERT_EQ(list.jobs.size(), 1u);
  EXPECT_EQ(list.jobs[0].name, "chair");
  ASSERT_EQ(list.failures.size(), 2u);
  EXPECT_EQ(list.failures[0].name, "bad.sh3f");
  EXPECT_EQ(list.failures[0].source, bad);
  EXPECT_EQ(list.failures[0].stage, "read");
  EXPECT_NE(list.failures[1].message.find("none.sh3f"), std::string::npos);
}

TEST(JobList, NothingGivesNothing) { EXPECT_TRUE(ListJobs({}, SingleRecipe({}), {}, {}).jobs.empty()); }

TEST(JobList, TheFirstOfTheListHaveEntriesOfTheirOwn) {
  Recipe recipe = SingleRecipe({});
  recipe.draws_all = true;
  recipe.entries[0].name = "a";
  recipe.entries.push_back(recipe.entries[0]);
  recipe.entries[1] = {"a-spz", 1, 1, recipe.entries[0].settings};
  recipe.entries[1].settings.from = "a";
  recipe.entries[1].settings.after = "spz";
  const JobList list = ListJobs({"z.obj", "b.obj"}, recipe, {}, {});
  std::vector<std::string> names, bases;
  for (const ObjectJob& job : list.jobs) {
    names.push_back(job.name);
    bases.push_back(job.base);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"b--a", "z--a", "z--a-spz"}));  // z is the first of the list
  EXPECT_EQ(bases, (std::vector<std::string>{"", "", "z--a"}));
}

}  // namespace
}  // namespace anchorsplat

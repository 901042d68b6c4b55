#include "cli/verb_words.h"

#include <gtest/gtest.h>

#include <vector>

namespace anchorsplat {
namespace {

class VerbWords : public ::testing::Test {
 protected:
  VerbWords() {
    for (const char* name : {"enhance", "info", "convert", "compare"}) app_.add_subcommand(name, "");
    CLI::App* dataset = app_.add_subcommand("dataset", "");
    dataset->add_subcommand("build", "");
    dataset->add_subcommand("hidden", "")->group("");
  }
  std::string Message(std::vector<std::string> words) {
    words.insert(words.begin(), "anchorsplat");
    const Status status = CheckVerbWords(app_, words);
    return status.ok() ? "" : status.error().message;
  }

  CLI::App app_{"", "anchorsplat"};
};

TEST_F(VerbWords, KnownOnesPass) {
  EXPECT_EQ(Message({"info", "whatever", "--x"}), "");
  EXPECT_EQ(Message({"dataset", "build", "whatever"}), "");
  EXPECT_EQ(Message({"dataset", "hidden"}), "");
  EXPECT_EQ(Message({"--version"}), "");
  EXPECT_EQ(Message({"dataset", "--help"}), "");
}

TEST_F(VerbWords, OthersAreNamedWithTheNearest) {
  EXPECT_EQ(Message({"comapre", "a"}),
            "'anchorsplat' has no verb 'comapre'; did you mean 'compare'? There are enhance, info, convert, compare, "
            "dataset (--help shows more)");
  EXPECT_EQ(
      Message({"scan.ply"}),
      "'anchorsplat' has no verb 'scan.ply'. There are enhance, info, convert, compare, dataset (--help shows more)");
  EXPECT_EQ(Message({"dataset", "biuld"}),
            "'anchorsplat dataset' has no verb 'biuld'; did you mean 'build'? There are build (--help shows more)");
  EXPECT_EQ(Message({}), "'anchorsplat' needs a verb: enhance, info, convert, compare, dataset (--help shows more)");
}

TEST(EditDistance, CountsLetters) {
  EXPECT_EQ(EditDistance("", "abc"), 3u);
  EXPECT_EQ(EditDistance("abc", ""), 3u);
  EXPECT_EQ(EditDistance("info", "info"), 0u);
  EXPECT_EQ(EditDistance("comapre", "compare"), 1u);
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3u);
}

}  // namespace
}  // namespace anchorsplat

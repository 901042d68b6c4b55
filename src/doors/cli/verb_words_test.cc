#include "cli/verb_words.h"

#include <gtest/gtest.h>

#include <vector>

#include "request/choice.h"

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

TEST_F(VerbWords, AShortNameTakesAnEqualsSign) {
  CLI::App* const convert = app_.get_subcommand("convert");
  convert->add_option("-t,--translate");
  convert->add_flag("-F,--filter-floaters");
  convert->add_flag("-q");
  using Words = std::vector<std::string>;
  EXPECT_EQ(
      WithLongNames(app_, Words{"anchorsplat", "convert", "-t=-1,0,0", "-F=0.5", "-F", "-t", "-1", "--", "-t=1"}),
      (Words{"anchorsplat", "convert", "--translate=-1,0,0", "--filter-floaters=0.5", "-F", "-t", "-1", "--", "-t=1"}));
  for (const Words& same :
       {Words{"anchorsplat", "info", "-t=1"}, {"anchorsplat", "convert", "-q=1", "-x=2", "-", "-t1="}}) {
    EXPECT_EQ(WithLongNames(app_, same), same);
  }
}

TEST_F(VerbWords, AnUnknownOptionIsNamedWithTheNearest) {
  app_.get_subcommand("convert")->add_flag("-F,--filter-floaters");
  using Words = std::vector<std::string>;
  EXPECT_EQ(UnknownOption(app_, Words{"anchorsplat", "convert", "a", "--filter-floaters", "-x", "--", "--y"}), "");
  EXPECT_EQ(UnknownOption(app_, Words{"anchorsplat", "convert", "a", "--filter-floater=2"}),
            "'anchorsplat convert' has no option '--filter-floater'; did you mean '--filter-floaters'?");
  EXPECT_EQ(UnknownOption(app_, Words{"anchorsplat", "dataset", "build", "--xyzzyxyzzy"}),
            "'anchorsplat dataset build' has no option '--xyzzyxyzzy'");
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

#include "cli/clean_output.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace anchorsplat {
namespace {

TEST(CleanOutput, NothingThatCommandsATerminalArrives) {
  std::ostringstream stream;
  {
    const CleanOutput clean(stream);
    stream << "a\x1b[2Jb\r\n"
           << "px² – ü\n"
           << '\x07'
           << "\xc2\x9b"
              "2J\xff\x7f";
  }
  EXPECT_EQ(stream.str(), "a\\x1b[2Jb\\x0d\npx² – ü\n\\x07\\xc2\\x9b2J\\xff\\x7f");
  stream << '\x1b';  // it is over
  EXPECT_TRUE(stream.str().ends_with('\x1b'));
}

TEST(CleanOutput, CharactersOfSeveralBytesMayComeInPieces) {
  std::ostringstream stream;
  {
    const CleanOutput clean(stream);
    stream << '\xc2' << '\xb2' << "\xe2\x80"
           << "\x93";
  }
  EXPECT_EQ(stream.str(), "²–");
}

TEST(CleanOutput, AFlushWritesWhatIsThere) {
  std::ostringstream stream;
  const CleanOutput clean(stream);
  stream << "half a line";
  EXPECT_EQ(stream.str(), "");
  stream << std::flush;
  EXPECT_EQ(stream.str(), "half a line");
}

TEST(CleanOutput, AStreamThatTakesNothingSaysSo) {
  struct : std::streambuf {
  } full;
  std::ostream stream(&full);
  const CleanOutput clean(stream);
  stream << "line\n" << std::flush;
  EXPECT_FALSE(stream.good());
}

TEST(CleanOutput, JsonStaysWhatItSays) {
  const nlohmann::json json = {{"name", "\x1b[2J \x7f \xc2\x9b \xc2\xa0 ü"}};
  const std::string text = CleanJson(json.dump());
  EXPECT_EQ(nlohmann::json::parse(text), json);
  std::ostringstream stream;
  {
    const CleanOutput clean(stream);
    stream << text;
  }
  EXPECT_EQ(stream.str(), text);
}

TEST(OneLine, EscapesLineEndsToo) { EXPECT_EQ(OneLine("a\nb\x1b.ply"), "a\\x0ab\\x1b.ply"); }

}  // namespace
}  // namespace anchorsplat

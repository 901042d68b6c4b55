#include "io/json_file.h"

#include <gtest/gtest.h>

#include <string>

namespace anchorsplat {
namespace {

std::string ErrorOf(const std::string& text) {
  const auto file = JsonFile::Parse("a.json", text);
  return file.ok() ? "accepted" : file.error().message;
}

TEST(JsonFile, ReadsWhatTheLibraryReads) {
  for (
      const std::string text :
      {R"({"a":[1,-2,3.5,1e300,true,false,null,"x\\u00e4\\n",[],{}],"b":{"c":{"d":[[[0]]]}},"a2":18446744073709551615})",
       "[]", "{}", "7", "\"text\"", "null", R"([{"k":1},{"k":2},{"k":[{"k":3}]}])", R"({"twice":1,"twice":[2]})"}) {
    const auto file = JsonFile::Parse("a.json", text);
    ASSERT_TRUE(file.ok()) << file.error().message;
    EXPECT_EQ(file->root().raw(), nlohmann::json::parse(text)) << text;
  }
}

TEST(JsonFile, SyntaxErrorsSayWhere) {
  for (const std::string text : {"", "{", "[1,", "{\"a\" 1}", "[1] 2", "{\n\"a\": nul}", "[\"\xff\"]", "nan"}) {
    EXPECT_NE(ErrorOf(text).find("a.json: not valid JSON: line "), std::string::npos) << text << ": " << ErrorOf(text);
  }
  EXPECT_NE(ErrorOf("{\n\"a\": nul}").find("line 2"), std::string::npos);
  EXPECT_NE(ErrorOf("[1e999]").find("number overflow"), std::string::npos);
}

TEST(JsonFile, Bounds) {
  EXPECT_EQ(ErrorOf(std::string(64, '[') + std::string(64, ']')), "accepted");
  EXPECT_NE(ErrorOf(std::string(65, '[') + std::string(65, ']')).find("nested deeper than 64"), std::string::npos);
  EXPECT_NE(ErrorOf(std::string(1'000'000, '[')).find("nested deeper"), std::string::npos);
  std::string many = "[0";
  many.reserve(size_t{1} << 26);
  for (int k = 0; k < (1 << 24); ++k) many += ",0";
  EXPECT_NE(ErrorOf(many + "]").find("more than 16,777,216 values"), std::string::npos);
}

// An array of objects: what each of them costs must not grow with their number.
TEST(JsonFile, ManyObjectsInAnArray) {
  std::string text = "[{}";
  for (int k = 1; k < 400'000; ++k) text += ",{\"k\":[]}";
  const auto file = JsonFile::Parse("a.json", text + "]");
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(file->root().raw().size(), 400'000u);
  EXPECT_EQ(file->root().Element(399'999).Complain("x").message, "a.json: [399999]: x");
}

}  // namespace
}  // namespace anchorsplat

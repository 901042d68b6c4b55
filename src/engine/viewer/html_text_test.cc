#include "viewer/html_text.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace anchorsplat {
namespace {

TEST(HtmlText, EscapesWhatEndsTextOrAttribute) {
  EXPECT_EQ(EscapeHtml("a<b>&\"'c"), "a&lt;b&gt;&amp;&quot;&#39;c");
  EXPECT_EQ(EscapeHtml("</title><script>alert(1)</script>"), "&lt;/title&gt;&lt;script&gt;alert(1)&lt;/script&gt;");
  EXPECT_EQ(EscapeHtml("Zürich"), "Zürich");
}

TEST(HtmlText, JsonCannotLeaveItsScriptAndKeepsItsValue) {
  const std::string hostile = "</script><!--<script>&\xe2\x80\xa8\xe2\x80\xa9 \xe2\x80\xa7 \"\\";
  const std::string text = EscapeJsonForScript(nlohmann::json(hostile).dump());
  EXPECT_EQ(text.find_first_of("<>&"), std::string::npos);
  EXPECT_EQ(text.find("\xe2\x80\xa8"), std::string::npos);
  EXPECT_EQ(text.find("\xe2\x80\xa9"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(text).get<std::string>(), hostile);
}

}  // namespace
}  // namespace anchorsplat

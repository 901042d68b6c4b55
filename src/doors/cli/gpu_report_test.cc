#include "cli/gpu_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace anchorsplat {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

GpuFindings WithAdapters(const std::vector<GpuAdapter>& adapters) {
  return {{.path = "/lib/libwgpu_native-release.so", .problem = ""}, adapters};
}

GpuAdapter Adapter(int number, GpuAdapter::Type type, const std::string& unusable = "") {
  GpuAdapter adapter;
  adapter.number = number;
  adapter.name = "Card";
  adapter.backend = "Vulkan";
  adapter.type = type;
  adapter.max_binding = 134'217'728;
  adapter.max_buffer = 268'435'456;
  adapter.unusable = unusable;
  return adapter;
}

TEST(GpuReport, SaysWhichAdapterAutoDoesNotTakeAndWhy) {
  const GpuFindings gpus = WithAdapters({Adapter(0, GpuAdapter::Type::kDiscrete), Adapter(1, GpuAdapter::Type::kCpu),
                                         Adapter(2, GpuAdapter::Type::kIntegrated, "it lacks something")});
  EXPECT_TRUE(gpus.ready());
  EXPECT_THAT(
      LinesOf(gpus),
      ElementsAre("0: Card, Vulkan, discrete; bindings up to 134 MB, buffers up to 268 MB", HasSubstr("1: Card"),
                  "   not chosen by auto: software renderer, slower than --device cpu", HasSubstr("2: Card"),
                  "   cannot be used: it lacks something", HasSubstr("/lib/libwgpu_native-release.so")));
  EXPECT_THAT(CommandFor(gpus), IsEmpty());
  const nlohmann::json json = ToJson(gpus);
  ASSERT_EQ(json["adapters"].size(), 3u);
  EXPECT_EQ(json["adapters"][0]["taken_by_auto"], true);
  EXPECT_FALSE(json["adapters"][0].contains("why_not"));
  EXPECT_EQ(json["adapters"][1]["type"], "cpu");
  EXPECT_EQ(json["adapters"][1]["usable"], true);
  EXPECT_EQ(json["adapters"][1]["taken_by_auto"], false);
  EXPECT_EQ(json["adapters"][2]["usable"], false);
  EXPECT_EQ(json["adapters"][2]["why_not"], "it lacks something");
  EXPECT_EQ(json["adapters"][0]["max_binding_bytes"], 134'217'728);
}

TEST(GpuReport, SaysWhatIsMissing) {
  const GpuFindings none{{.path = "", .problem = "there is no library"}, {}};
  EXPECT_FALSE(none.ready());
  EXPECT_THAT(LinesOf(none), ElementsAre("there is no library"));
  EXPECT_THAT(CommandFor(none), Not(IsEmpty()));
  EXPECT_TRUE(ToJson(none)["library"].is_null());
  EXPECT_EQ(ToJson(none)["problem"], "there is no library");

  const GpuFindings named{{.path = "", .problem = "it is cut short", .named = true}, {}};
  EXPECT_TRUE(named.broken());
  EXPECT_FALSE(none.broken());
  EXPECT_THAT(CommandFor(named), HasSubstr("ANCHORSPLAT_WEBGPU"));

  const GpuFindings no_driver = WithAdapters({});
  EXPECT_FALSE(no_driver.ready());
  EXPECT_THAT(LinesOf(no_driver), ElementsAre(HasSubstr("finds no adapter")));
  EXPECT_THAT(CommandFor(no_driver), HasSubstr("driver"));
  EXPECT_FALSE(WithAdapters({Adapter(0, GpuAdapter::Type::kDiscrete, "it is old")}).ready());
}

}  // namespace
}  // namespace anchorsplat

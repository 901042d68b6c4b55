#include "dataset/object_settings.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

namespace anchorsplat {
namespace {

ObjectSettings Unusual() {
  ObjectSettings s;
  s.views.rig.kind = RigKind::kRings;
  s.views.rig.views = 12;
  s.views.rig.radius = 2.25;
  s.views.rig.fov_degrees = 50;
  s.views.rig.elevations = {-10, 45.5};
  s.views.high_size = 800;
  s.views.low_size = 200;
  s.views.trace.samples = 2;
  s.views.background = {1, 0.1f, 0};
  s.views.opaque = true;
  s.views.points = 77;
  s.views.store_high = false;
  s.fit_steps = 7000;
  s.hold_out = 0;
  s.downscale = 3;
  s.max_gaussians = 12345;
  s.min_train_psnr = 30.5;
  s.seed = ~uint64_t{0};
  s.start = FitStart::kRandom;
  s.init_points = 1234;
  s.init_extent = 0.25;
  s.sh_degree = 1;
  s.mode = RenderMode::kAntialiased;
  s.pixel_area = true;
  s.strategy = FitPreset::kAbsgrad;
  s.defects = {.noise = 3.5, .jpeg = 70, .exposure = 0.1, .pose = 0.3, .mask = 1, .defocus = 0.75};
  s.backdrop = true;
  s.from = "standard";
  s.after = "sog";
  return s;
}

Result<ObjectSettings> Back(const nlohmann::json& json) {
  auto file = JsonFile::Parse("settings.json", json.dump());
  if (!file.ok()) return file.error();
  return ObjectSettingsFrom(file->root());
}

TEST(ObjectSettings, ComeBackAsTheyWere) {
  for (const ObjectSettings& settings : {Unusual(), ObjectSettings()}) {
    const auto back = Back(ToJson(settings));
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(ToJson(settings), ToJson(*back));
    EXPECT_EQ(back->seed, settings.seed);
    EXPECT_EQ(back->views.seed, settings.seed);
    EXPECT_EQ(back->views.background, settings.views.background);
  }
}

TEST(ObjectSettings, EveryMemberIsNeededAndChecked) {
  const nlohmann::json good = ToJson(Unusual());
  // Which the first data sets do not have.
  const std::set<std::string> newer = {"downscale", "init",     "init_points", "init_extent", "sh_degree", "mode",
                                       "pixel",     "strategy", "mip_filter",  "defects",     "backdrop"};
  for (const auto& [key, value] : good.items()) {
    nlohmann::json missing = good;
    missing.erase(key);
    if (key == "init") missing.erase("init_points"), missing.erase("init_extent");
    EXPECT_EQ(Back(missing).ok(), newer.contains(key)) << key;
    nlohmann::json wrong = good;
    wrong[key] = nullptr;
    EXPECT_FALSE(Back(wrong).ok()) << key;
  }
  const auto refused = [&](const char* key, const nlohmann::json& value) {
    nlohmann::json json = good;
    json[key] = value;
    const auto back = Back(json);
    return !back.ok() && back.error().code == ErrorCode::kBadFile;
  };
  EXPECT_TRUE(refused("low_size", 800));
  EXPECT_TRUE(refused("low_size", 900));
  EXPECT_TRUE(refused("points", 0));
  EXPECT_TRUE(refused("fit_steps", 0));
  EXPECT_TRUE(refused("fit_steps", 1.5));
  EXPECT_TRUE(refused("hold_out", 1));
  EXPECT_TRUE(refused("downscale", 1));
  EXPECT_TRUE(refused("rig", "spiral"));
  EXPECT_TRUE(refused("seed", "-1"));
  EXPECT_TRUE(refused("seed", "123456789012345678901"));
  EXPECT_TRUE(refused("background", {0, 0, 2}));
  EXPECT_TRUE(refused("views", 1e9));
  EXPECT_TRUE(refused("init", "surface"));  // with init_points, which it has not
  EXPECT_TRUE(refused("init", "view"));     // with init_extent, likewise
  EXPECT_TRUE(refused("init_extent", 0));
  EXPECT_TRUE(refused("init_extent", 1e9));
  EXPECT_TRUE(refused("init", "cube"));
  EXPECT_TRUE(refused("sh_degree", 4));
  EXPECT_TRUE(refused("mode", "sharp"));
  EXPECT_TRUE(refused("pixel", "disc"));
  EXPECT_TRUE(refused("strategy", "magic"));
  EXPECT_TRUE(refused("mip_filter", true));  // with a mode and pixels of another kind
  EXPECT_TRUE(refused("defects", {{"noise", 1}}));
  EXPECT_TRUE(refused("after", "zip"));
  EXPECT_TRUE(refused("from", ""));  // without what after is about
  nlohmann::json mcmc = ToJson(ObjectSettings());
  mcmc["strategy"] = "mcmc";
  EXPECT_FALSE(Back(mcmc).ok());
  mcmc["max_gaussians"] = 20000;
  EXPECT_TRUE(Back(mcmc).ok());
}

}  // namespace
}  // namespace anchorsplat

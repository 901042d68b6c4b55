#include "dataset/object_settings.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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
  for (const auto& [key, value] : good.items()) {
    nlohmann::json missing = good;
    missing.erase(key);
    EXPECT_EQ(Back(missing).ok(), key == "downscale") << key;  // which the first data sets do not have
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
}

}  // namespace
}  // namespace anchorsplat

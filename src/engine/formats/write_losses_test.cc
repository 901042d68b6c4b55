#include "formats/write_losses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/random_cloud_for_test.h"

namespace anchorsplat {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(WriteLosses, NamesTheRenderModeThatAFormatCannotSay) {
  GaussianCloud cloud = RandomCloud(10, 0, 1);
  for (float& x : cloud.sh) x *= 0.1f;
  const auto losses = [&](const char* format) { return WriteLosses(*FormatOfName(format), cloud); };
  const auto all = {".ply", ".compressed.ply", ".spz", ".sog", ".splat", ".glb", ".csv"};
  for (const char* format : all) EXPECT_THAT(losses(format), IsEmpty()) << format;
  cloud.render_mode = RenderMode::kClassic;  // what is drawn where nothing is said
  for (const char* format : all) EXPECT_THAT(losses(format), IsEmpty()) << format;

  cloud.render_mode = RenderMode::kAntialiased;
  for (const char* format : {".ply", ".compressed.ply", ".spz", ".sog"}) EXPECT_THAT(losses(format), IsEmpty());
  for (const char* format : {".splat", ".glb", ".csv"}) {
    EXPECT_THAT(losses(format), ElementsAre(AllOf(HasSubstr("antialiased"), HasSubstr("classic")))) << format;
  }
  cloud.render_mode = RenderMode::kMip;
  for (const char* format : {".ply", ".compressed.ply"}) EXPECT_THAT(losses(format), IsEmpty());
  for (const char* format : {".spz", ".sog"}) {
    EXPECT_THAT(losses(format), ElementsAre(AllOf(HasSubstr("0.3 px²"), HasSubstr("0.1")))) << format;
  }
  EXPECT_THAT(losses(".splat"), ElementsAre(HasSubstr("mip")));
}

TEST(WriteLosses, NamesTheCreditsThatAFormatCannotSay) {
  GaussianCloud cloud = RandomCloud(10, 0, 1);
  for (float& x : cloud.sh) x *= 0.1f;
  cloud.comments = {"world up: 0 -1 0", "made by a test"};
  const auto losses = [&](const char* format) { return WriteLosses(*FormatOfName(format), cloud); };
  for (const char* format : {".spz", ".splat", ".csv", ".npz", ".pt"}) EXPECT_THAT(losses(format), IsEmpty()) << format;
  cloud.comments.insert(cloud.comments.end(), {"credit: Mug by Ann, CC BY 4.0", "credit: scanned by Bob"});
  for (const char* format : {".ply", ".compressed.ply", ".sog", ".glb", ".gltf"}) {
    EXPECT_THAT(losses(format), IsEmpty()) << format;
  }
  for (const char* format : {".spz", ".splat", ".csv", ".npz", ".pt"}) {
    EXPECT_THAT(losses(format), ElementsAre(AllOf(HasSubstr("\"Mug by Ann, CC BY 4.0\", \"scanned by Bob\""),
                                                  HasSubstr("cannot store credits"))))
        << format;
  }
  EXPECT_THAT(losses(".spz"), ElementsAre(HasSubstr("an SPZ file")));
  EXPECT_THAT(losses(".npz"), ElementsAre(HasSubstr("an NPZ file")));
  for (const char* mark :
       {"enhanced by anchorsplat: filter, 4 times closer", "enhanced in part by anchorsplat: filter, 4 times closer",
        "fitted to pixel areas, seen 4 times closer"}) {
    cloud.comments = {mark};
    for (const char* format : {".ply", ".compressed.ply", ".sog", ".glb", ".gltf"}) {
      EXPECT_THAT(losses(format), IsEmpty()) << format;
    }
    for (const char* format : {".spz", ".splat", ".csv", ".npz", ".pt"}) {
      EXPECT_THAT(losses(format), ElementsAre(HasSubstr("cannot store that the splat was"))) << format;
    }
  }
}

TEST(WriteLosses, NamesWhatAFileDeclaredAndAnotherCannot) {
  GaussianCloud cloud = RandomCloud(10, 0, 1);
  for (float& x : cloud.sh) x *= 0.1f;
  const auto losses = [&](const char* format) { return WriteLosses(*FormatOfName(format), cloud); };
  cloud.comments = {"Vertical Axis: z"};
  for (const char* format : {".ply", ".compressed.ply", ".sog", ".glb"})
    EXPECT_THAT(losses(format), IsEmpty()) << format;
  for (const char* format : {".spz", ".splat", ".npz"}) {
    EXPECT_THAT(losses(format), ElementsAre(HasSubstr("cannot store the up direction, 0 0 1"))) << format;
  }
  cloud.comments = {"SPZ extension SPZ_ADOBE_safe_orbit_camera (0xADBE0002): 000000000000000000000000"};
  for (const char* format : {".ply", ".compressed.ply", ".spz"}) EXPECT_THAT(losses(format), IsEmpty()) << format;
  for (const char* format : {".sog", ".glb", ".splat"}) {
    EXPECT_THAT(losses(format), ElementsAre(HasSubstr("cannot store SPZ_ADOBE_safe_orbit_camera"))) << format;
  }
}

}  // namespace
}  // namespace anchorsplat

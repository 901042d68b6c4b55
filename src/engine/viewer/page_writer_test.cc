#include "viewer/page_writer.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/framing.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "formats/splat_order.h"
#include "images/image_io.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "render/constants.h"
#include "viewer/fitted_cloud.h"
#include "viewer/page_files.h"
#include "viewer/page_folder.h"
#include "viewer/quantized_cloud.h"

namespace anchorsplat {
namespace {

// The text of the element with this id, as a browser would find it: up to the next end tag.
std::string ElementText(const std::string& page, const std::string& id) {
  const std::string mark = Cat("id=\"", id, "\">");
  const size_t begin = page.find(mark);
  if (begin == std::string::npos) return {};
  const size_t first = begin + mark.size();
  return page.substr(first, page.find("</script", first) - first);
}

std::vector<uint8_t> FromBase64(const std::string& text) {
  static const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<uint32_t, 256> codes{};
  for (uint32_t k = 0; k < 64; ++k) codes[static_cast<uint8_t>(alphabet[k])] = k;
  std::vector<uint8_t> bytes;
  uint32_t bits = 0;
  int count = 0;
  for (char c : text) {
    if (c == '=') break;
    bits = bits << 6 | codes[static_cast<uint8_t>(c)];
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes.push_back(static_cast<uint8_t>(bits >> count & 255));
    }
  }
  return bytes;
}

// The planes of a splat, as the page's worker puts them together.
std::vector<uint8_t> Planes(const std::string& page, const nlohmann::json& splat) {
  std::vector<uint8_t> planes;
  for (const auto& id : splat.at("pieces")) {
    const std::vector<uint8_t> packed = FromBase64(ElementText(page, id));
    std::vector<uint8_t> piece(splat.at("pieceBytes").get<size_t>());
    uLongf size = piece.size();
    if (uncompress(piece.data(), &size, packed.data(), packed.size()) != Z_OK) ADD_FAILURE() << id;
    planes.insert(planes.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return planes;
}

size_t Count(const std::string& text, std::string_view what) {
  size_t n = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

ViewerView View(const std::string& name) {
  ViewerView view;
  view.camera.name = name;
  view.camera.intrinsics = PinholeFromFov(64, 48, 0.8);
  view.camera.world_to_camera = *LookAt({0, 0, 2}, {0, 0, 0}, {0, 1, 0});
  return view;
}

TEST(PageWriter, DataComesBackAsItWentIn) {
  TestFolder folder;
  const GaussianCloud after = FittedLookingCloud(70'000, 3, 1);  // more than one piece
  const GaussianCloud before = FittedLookingCloud(100, 1, 2);
  ViewerPage page;
  page.after = {&after, "after.ply", 12345};
  page.before = ViewerSplat{&before, "before.ply", {}};
  page.views = {View("a")};
  page.pixel_size = 0.5f;
  page.background = {1, 0.5f, 0.25f};
  const Status status = WriteViewerPage(folder / "page.html", page);
  ASSERT_TRUE(status.ok()) << status.error().message;

  const std::string text = FileBytes(folder / "page.html");
  const auto description = nlohmann::json::parse(ElementText(text, "description"));
  EXPECT_EQ(description["title"], "after.ply");
  EXPECT_EQ(description["after"]["fileBytes"], 12345);
  EXPECT_TRUE(description["before"]["fileBytes"].is_null());
  EXPECT_EQ(description["pixelSize"], 0.5);
  EXPECT_EQ(description["background"], (nlohmann::json{1, 0.5, 0.25}));
  EXPECT_EQ(description["views"].size(), 1u);
  EXPECT_GE(description["after"]["pieces"].size(), 2u);

  const QuantizedCloud q = *Quantize(after, 3);
  EXPECT_EQ(Planes(text, description["after"]), q.planes);
  EXPECT_EQ(description["after"]["center"].get<decltype(q.center)>(), q.center);
  EXPECT_EQ(description["after"]["spread"], q.spread);
  EXPECT_EQ(description["after"]["reach"], q.reach);
  EXPECT_EQ(description["after"]["logScale"].get<decltype(q.log_scale)>(), q.log_scale);
  EXPECT_EQ(description["after"]["dc"].get<decltype(q.dc)>(), q.dc);
  EXPECT_EQ(description["after"]["shMax"].get<decltype(q.sh_max)>(), q.sh_max);
  EXPECT_EQ(description["after"]["planes"], PlanesPerGaussian(3));
  EXPECT_EQ(description["before"]["planes"], PlanesPerGaussian(1));
  EXPECT_EQ(Planes(text, description["before"]), Quantize(before, 3)->planes);
}

// The pieces of a part, as the page gets them.
std::vector<uint8_t> PartPlanes(const std::filesystem::path& folder, const nlohmann::json& splat, size_t number) {
  const nlohmann::json& part = splat.at("parts").at(number);
  const std::string text = FileBytes(folder / part.at("file").get<std::string>());
  const std::string call = "anchorsplatPart(";
  EXPECT_TRUE(text.starts_with(call) && text.ends_with(");\n"));
  const auto words = nlohmann::json::parse("[" + text.substr(call.size(), text.size() - call.size() - 3) + "]");
  EXPECT_EQ(words[0], part.at("token"));
  EXPECT_EQ(words[1], part.at("id"));
  std::vector<uint8_t> planes;
  for (const auto& packed64 : words[2]) {
    const std::vector<uint8_t> packed = FromBase64(packed64);
    std::vector<uint8_t> piece(splat.at("pieceBytes").get<size_t>());
    uLongf size = piece.size();
    EXPECT_EQ(uncompress(piece.data(), &size, packed.data(), packed.size()), Z_OK);
    planes.insert(planes.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return planes;
}

TEST(PageWriter, AFolderHoldsTheLargestGaussiansFirst) {
  TestFolder folder;
  GaussianCloud cloud = FittedLookingCloud(kPartGaussians + 1000, 1, 3);
  cloud.means[0] = std::numeric_limits<float>::quiet_NaN();
  ViewerPage page;
  page.after = {&cloud, "after.ply", 12345};
  page.folder = true;
  page.max_bytes = 500'000;  // of the page alone
  const Status status = WriteViewerPage(folder / "my page.html", page);
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_EQ(folder.Entries(), 2) << "the page and its data";
  const std::string text = FileBytes(folder / "my page.html");
  EXPECT_EQ(Count(text, "script-src 'unsafe-inline' blob: 'self' file:;"), 1u);
  const auto splat = nlohmann::json::parse(ElementText(text, "description"))["after"];
  EXPECT_FALSE(splat.contains("pieces"));
  ASSERT_EQ(splat["parts"].size(), 2u);
  EXPECT_EQ(splat["parts"][0]["file"], "my%20page.data/after-0.js");
  EXPECT_EQ(splat["parts"][0]["count"], kPartGaussians);
  EXPECT_EQ(splat["parts"][1]["count"], 999);
  EXPECT_EQ(splat["count"], kPartGaussians + 999);

  const MeasuredCloud measured = *MeasureCloud(cloud, 3);
  std::vector<int64_t> rows;
  for (const uint32_t row : ImportanceOrder(cloud)) {
    if (row != 0) rows.push_back(row);
  }
  const std::filesystem::path data = folder.path();
  for (size_t part = 0; part < 2; ++part) {
    std::vector<int64_t> own(rows.begin() + (part == 0 ? 0 : kPartGaussians),
                             part == 0 ? rows.begin() + kPartGaussians : rows.end());
    std::ranges::sort(own);
    nlohmann::json plain = splat;
    plain["parts"][part]["file"] = "my page.data/after-" + std::to_string(part) + ".js";
    EXPECT_EQ(PartPlanes(data, plain, part), PlanesOf(cloud, measured.scale, own));
  }
}

TEST(PageWriter, AnOlderFolderGoesWithItsPage) {
  TestFolder folder;
  GaussianCloud cloud = FittedLookingCloud(100, 0, 3);
  ViewerPage page;
  page.after = {&cloud, "after.ply", {}};
  page.folder = true;
  const std::filesystem::path path = folder / "page.html";
  const auto file_of_part = [&] {
    return nlohmann::json::parse(ElementText(FileBytes(path), "description"))["after"]["parts"][0]["file"];
  };
  ASSERT_TRUE(WriteViewerPage(path, page).ok());
  EXPECT_EQ(file_of_part(), "page.data/after-0.js");
  EXPECT_EQ(WriteViewerPage(path, page).error().code, ErrorCode::kExists);
  ASSERT_TRUE(WriteViewerPage(path, page, {.overwrite = true}).ok());
  EXPECT_EQ(file_of_part(), "page.data-2/after-0.js") << "the older page worked until the new one was there";
  EXPECT_EQ(folder.Entries(), 2);
  // What somebody put beside the parts is not ours to remove.
  std::ofstream(folder / "page.data-2/notes.txt") << "mine";
  ASSERT_TRUE(WriteViewerPage(path, page, {.overwrite = true}).ok());
  EXPECT_EQ(file_of_part(), "page.data/after-0.js");
  EXPECT_TRUE(std::filesystem::exists(folder / "page.data-2/notes.txt"));
}

TEST(PageWriter, SaysWhereUpIsAndHowLargeTheSplatIs) {
  TestFolder folder;
  GaussianCloud cloud = FittedLookingCloud(500, 0, 1);
  const auto description = [&](const ViewerPage& page) {
    EXPECT_TRUE(WriteViewerPage(folder / "page.html", page, {.overwrite = true}).ok());
    return nlohmann::json::parse(ElementText(FileBytes(folder / "page.html"), "description"));
  };
  ViewerPage page;
  page.after = {&cloud, "after.ply", {}};
  const auto plain = description(page);
  EXPECT_EQ(plain["up"], (nlohmann::json{0, -1, 0}));
  const Framing framing = FrameCloud(cloud);
  EXPECT_EQ(plain["after"]["subject"]["radius"], framing.radius);
  EXPECT_EQ(plain["after"]["subject"]["target"], nlohmann::json(framing.target));
  EXPECT_FLOAT_EQ(plain["constants"]["nearShare"].get<float>(), kNearShare);
  cloud.comments = {UpComment({0, 0, 1})};
  EXPECT_EQ(description(page)["up"], (nlohmann::json{0, 0, 1}));
  page.views = {View("a")};  // cameras know better
  EXPECT_EQ(description(page)["up"], (nlohmann::json{0, 1, 0}));
}

TEST(PageWriter, APairOfFourTimesAsManyGaussiansFitsEightMegabytes) {
  TestFolder folder;
  const GaussianCloud before = FittedLookingCloud(17'000, 3, 1);
  const GaussianCloud after = FittedLookingCloud(68'000, 3, 2);
  ViewerPage page;
  page.after = {&after, "after", {}};
  page.before = ViewerSplat{&before, "before", {}};
  ASSERT_TRUE(WriteViewerPage(folder / "page.html", page).ok());
  EXPECT_LT(std::filesystem::file_size(folder / "page.html"), 8'000'000u);
}

TEST(PageWriter, NothingIsFetchedAndNoCodeIsMade) {
  TestFolder folder;
  const GaussianCloud cloud = FittedLookingCloud(10, 0, 1);
  ViewerPage page;
  page.after = {&cloud, "x", {}};
  ASSERT_TRUE(WriteViewerPage(folder / "page.html", page).ok());
  const std::string text = FileBytes(folder / "page.html");
  for (const char* word :
       {"http:", "https:", "ftp:", "@import", "url(", "fetch(", "XMLHttpRequest", "WebSocket", "EventSource",
        "sendBeacon", "importScripts", "eval(", "Function(", "innerHTML", "document.write", "javascript:", "{{"}) {
    EXPECT_EQ(text.find(word), std::string::npos) << word;
  }
  EXPECT_NE(text.find("Content-Security-Policy\" content=\"default-src 'none';"), std::string::npos);
  for (const char* handler : {" onload=", " onclick=", " onerror=", " oninput=", " onchange=", " onpointerdown="}) {
    EXPECT_EQ(text.find(handler), std::string::npos) << handler;
  }
  for (const std::string attribute : {" src=\"", " href=\""}) {
    for (size_t at = text.find(attribute); at != std::string::npos; at = text.find(attribute, at + 1)) {
      EXPECT_EQ(text.substr(at + attribute.size(), 5), "data:");
    }
  }
}

// Of a file that was cut browsers run the scripts that are whole: one of them, before all else that takes room, says
// what is wrong unless the very last one has run.
TEST(PageWriter, TheGuardComesFirstAndTheStartLast) {
  TestFolder folder;
  const GaussianCloud cloud = FittedLookingCloud(10, 0, 1);
  ViewerPage page;
  page.title = std::string(5000, 't');
  page.after = {&cloud, "x", {}};
  ASSERT_TRUE(WriteViewerPage(folder / "page.html", page).ok());
  const std::string text = FileBytes(folder / "page.html");
  const size_t guard = text.find("DOMContentLoaded"), guard_end = text.find("</script>");
  EXPECT_LT(text.find("<script>"), guard);
  EXPECT_LT(guard, guard_end);
  EXPECT_LT(guard_end, 2000u);
  for (const char* later : {"<title>", "<style>", "<body>", "id=\"after-0\""}) {
    EXPECT_LT(guard_end, text.find(later)) << later;
  }
  EXPECT_EQ(Count(text, "dataset.whole"), 2u);
  const size_t start = text.rfind("<script>"), said = text.rfind("dataset.whole");
  EXPECT_LT(start, said);
  EXPECT_EQ(text.find("<script", said), std::string::npos);
  EXPECT_LT(text.find("id=\"description\""), start);
  EXPECT_EQ(Count(text, "\nmain();"), 1u);
  EXPECT_GT(text.find("\nmain();"), said);
  EXPECT_EQ(Count(text, "<script>\n</script>"), 0u) << "a file that the program does not carry";
  // What follows it is nothing that a cut could take away.
  EXPECT_EQ(text.substr(text.find("</script>", said)), "</script>\n</body>\n</html>\n");
}

TEST(PageWriter, ItsOwnFilesStayInsideTheirElements) {
  for (const char* name : {"page.css", "payload.js", "camera.js", "shaders.js", "pictures.js", "renderer.js", "box.js",
                           "interface.js", "app.js", "worker.js"}) {
    const std::string text(PageFile(name));
    EXPECT_GT(text.size(), 500u) << name;
    EXPECT_EQ(text.find("</s"), std::string::npos) << name;
    EXPECT_EQ(text.find("<!--"), std::string::npos) << name;
    if (std::string_view(name).ends_with(".js")) {
      EXPECT_EQ(text.rfind("'use strict';", 0), 0u) << name;
    }
  }
  EXPECT_TRUE(PageFile("nothing").empty());
}

TEST(PageWriter, CarriesTheCreditsOfItsSplats) {
  TestFolder folder;
  GaussianCloud before = FittedLookingCloud(10, 0, 1), after = before;
  before.comments = {"credit: Mug by Ann, CC BY 4.0", "credit: </script><b>"};
  after.comments = {"credit: Mug by Ann, CC BY 4.0"};
  ViewerPage page;
  page.after = {&after, "after", {}};
  page.before = ViewerSplat{&before, "before", {}};
  ASSERT_TRUE(WriteViewerPage(folder / "page.html", page).ok());
  const std::string text = FileBytes(folder / "page.html");
  EXPECT_EQ(nlohmann::json::parse(ElementText(text, "description"))["credits"],
            (nlohmann::json{"Mug by Ann, CC BY 4.0", "</script><b>"}));
  EXPECT_EQ(text.find("<b>"), std::string::npos);
}

TEST(PageWriter, HostileNamesStayText) {
  TestFolder folder;
  const GaussianCloud cloud = FittedLookingCloud(10, 0, 1);
  const auto write = [&](const std::string& name) {
    ViewerPage page;
    page.title = name;
    page.after = {&cloud, name, {}};
    page.before = ViewerSplat{&cloud, name, {}};
    page.views = {View(name)};
    EXPECT_TRUE(WriteViewerPage(folder / "page.html", page, {.overwrite = true}).ok());
    return FileBytes(folder / "page.html");
  };
  const std::string plain = write("plain");
  for (const std::string& name :
       {std::string("</title></style><script>alert(1)</script>"), std::string("</script><!--<script>"),
        std::string("{{data}}{{style}}{{title}}"), std::string("\" onload=\"alert(1)"), std::string("-->]]>&lt;"),
        std::string("\xff\xfe</script>\xc3"), std::string("\xe2\x80\xa8'\\u003c"), std::string("a\0<b>", 5)}) {
    const std::string text = write(name);
    for (const char* tag : {"<script", "</script", "<!--", "</title", "</style", "<b>"}) {
      EXPECT_EQ(Count(text, tag), Count(plain, tag)) << Printable(name) << ": " << tag;
    }
    const auto description = nlohmann::json::parse(ElementText(text, "description"));
    if (name[0] != '\xff') {
      EXPECT_EQ(description["after"]["name"], name);
      EXPECT_EQ(description["views"][0]["name"], name);
    }
  }
}

TEST(PageWriter, RenderModeAndDegreeAreTheClouds) {
  TestFolder folder;
  GaussianCloud cloud = FittedLookingCloud(10, 3, 1);
  cloud.render_mode = RenderMode::kMip;
  GaussianCloud antialiased = FittedLookingCloud(10, 0, 1), untold = antialiased;
  antialiased.render_mode = RenderMode::kAntialiased;
  ViewerPage page;
  page.after = {&cloud, "x", {}};
  page.max_sh_degree = 1;
  ASSERT_TRUE(WriteViewerPage(folder / "page.html", page).ok());
  const auto description = nlohmann::json::parse(ElementText(FileBytes(folder / "page.html"), "description"));
  EXPECT_EQ(description["after"]["mode"], "mip");
  EXPECT_EQ(description["after"]["compensated"], true);
  EXPECT_NEAR(description["after"]["dilation"].get<double>(), 0.1, 1e-7);
  EXPECT_EQ(description["after"]["degree"], 1);
  EXPECT_EQ(description["after"]["fileDegree"], 3);
  EXPECT_TRUE(description["before"].is_null());

  page.after = {&antialiased, "x", {}};
  page.before = ViewerSplat{&untold, "y", {}};
  ASSERT_TRUE(WriteViewerPage(folder / "two.html", page).ok());
  const auto two = nlohmann::json::parse(ElementText(FileBytes(folder / "two.html"), "description"));
  EXPECT_EQ(two["after"]["mode"], "antialiased");
  EXPECT_EQ(two["before"]["mode"], "classic");
  EXPECT_EQ(two["before"]["compensated"], false);
  for (const char* side : {"after", "before"}) EXPECT_NEAR(two[side]["dilation"].get<double>(), 0.3, 1e-7);
}

TEST(PageWriter, PicturesTravelAsTheyAre) {
  TestFolder folder;
  const GaussianCloud cloud = FittedLookingCloud(10, 0, 1);
  ASSERT_TRUE(WritePng(folder / "truth.png", Image(5, 4, 3)).ok());
  ViewerPage page;
  page.after = {&cloud, "x", {}};
  page.views = {View("none"), View("some")};
  page.views[1].picture = folder / "truth.png";
  ASSERT_TRUE(WriteViewerPage(folder / "page.html", page).ok());
  const std::string text = FileBytes(folder / "page.html");
  const auto views = nlohmann::json::parse(ElementText(text, "description"))["views"];
  EXPECT_TRUE(views[0]["picture"].is_null());
  EXPECT_EQ(views[1]["picture"]["type"], "image/png");
  const std::vector<uint8_t> bytes = FromBase64(ElementText(text, views[1]["picture"]["element"]));
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), FileBytes(folder / "truth.png"));
}

TEST(PageWriter, ErrorsSayWhatToDoAndLeaveNothingBehind) {
  TestFolder folder;
  const GaussianCloud cloud = FittedLookingCloud(1000, 3, 1);
  ViewerPage good;
  good.after = {&cloud, "x", {}};
  const auto error = [&](const ViewerPage& page) {
    const Status status = WriteViewerPage(folder / "page.html", page);
    EXPECT_FALSE(status.ok());
    EXPECT_EQ(folder.Entries(), 1);  // the one that is no picture
    return status.ok() ? Error{ErrorCode::kIo, "none"} : status.error();
  };
  std::ofstream(folder / "text.png") << "no picture at all";

  ViewerPage page = good;
  page.pixel_size = 0.f;
  EXPECT_EQ(error(page).code, ErrorCode::kBadArgument);

  const GaussianCloud empty;
  page = good;
  page.before = ViewerSplat{&empty, "nothing.ply", {}};
  EXPECT_EQ(error(page).code, ErrorCode::kBadArgument);
  EXPECT_NE(error(page).message.find("nothing.ply"), std::string::npos);

  page = good;
  page.after.cloud = nullptr;
  EXPECT_EQ(error(page).code, ErrorCode::kBadArgument);

  page = good;
  page.views = {View("a")};
  page.views[0].picture = folder / "missing.png";
  EXPECT_EQ(error(page).code, ErrorCode::kNotFound);
  page.views[0].picture = folder / "text.png";
  EXPECT_EQ(error(page).code, ErrorCode::kBadFile);

  for (uint64_t limit : {uint64_t{5'000}, uint64_t{60'000}}) {  // before and after packing
    page = good;
    page.max_bytes = limit;
    EXPECT_EQ(error(page).code, ErrorCode::kBadArgument);
    EXPECT_NE(error(page).message.find("a browser opens well; leave something out"), std::string::npos);
  }

  ASSERT_TRUE(WriteViewerPage(folder / "page.html", good).ok());
  EXPECT_EQ(WriteViewerPage(folder / "page.html", good).error().code, ErrorCode::kExists);
  EXPECT_TRUE(WriteViewerPage(folder / "page.html", good, {.overwrite = true}).ok());
}

TEST(ViewerPage, ASampleTellsThatItIsTooLarge) {
  const GaussianCloud cloud = FittedLookingCloud(20'000, 3, 5);
  ViewerPage page;
  page.after.cloud = &cloud;
  page.before = ViewerSplat{&cloud, "before", {}};
  const uint64_t both = 2 * EstimatedPageBytes(cloud);
  page.max_bytes = 3 * both / 4;
  const Status refused = CheckPageSize("page.html", page);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kBadArgument);
  EXPECT_NE(refused.error().message.find("the page would take about "), std::string::npos) << refused.error().message;
  page.max_bytes = both;
  EXPECT_TRUE(CheckPageSize("page.html", page).ok());
  page.max_bytes = 1;
  page.folder = true;
  EXPECT_TRUE(CheckPageSize("page.html", page).ok());
}

TEST(ViewerPage, EstimateIsNearWhatItTakes) {
  const TestFolder folder;
  const auto page_bytes = [&folder](const GaussianCloud& cloud, int degree) {
    ViewerPage page;
    page.after.cloud = &cloud;
    page.max_sh_degree = degree;
    EXPECT_TRUE(WriteViewerPage(folder / "page.html", page, {.overwrite = true}).ok());
    return static_cast<double>(std::filesystem::file_size(folder / "page.html"));
  };
  const double empty = page_bytes(FittedLookingCloud(1, 0, 1), 0);
  const GaussianCloud cloud = FittedLookingCloud(150'000, 2, 1);  // more than the sample
  for (const int degree : {0, cloud.sh_degree}) {
    const double bytes = page_bytes(cloud, degree) - empty;
    EXPECT_NEAR(static_cast<double>(EstimatedPageBytes(cloud, degree)), bytes, 0.1 * bytes) << degree;
    EXPECT_LT(bytes, 150'000 * MostPageBytes(degree)) << degree;
  }
  EXPECT_EQ(EstimatedPageBytes(GaussianCloud{}), 0u);
}

}  // namespace
}  // namespace anchorsplat

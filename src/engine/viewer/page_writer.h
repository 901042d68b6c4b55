#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "io/write_options.h"

namespace anchorsplat {

struct OutputMemory;

struct ViewerSplat {
  const GaussianCloud* cloud = nullptr;  // read only while the page is written
  std::string name;                      // as people know it ("input.ply"); any bytes
  std::optional<uint64_t> file_bytes;    // size of the file it came from
};

// A camera to jump to and, where there is one, the true picture from there: a PNG or JPEG, put into the page as it is.
struct ViewerView {
  Camera camera;
  std::filesystem::path picture;  // empty: none
};

// A page above this is refused: browsers need several times its size in memory to open it.
inline constexpr uint64_t kMaxPageBytes = 300'000'000;

struct ViewerPage {
  std::string title;  // any bytes; the name of `after` where it is empty
  ViewerSplat after;
  std::optional<ViewerSplat> before;
  std::vector<ViewerView> views;      // the first one opens the page; without any the page finds its own
  std::optional<float> pixel_size;    // world units one training pixel covers at the object; for the scale bar
  std::string own_page;               // http(s) address of where readers can open a splat of their own; empty: none
  std::array<float, 3> background{};  // rgb 0–1
  int max_sh_degree = kMaxShDegree;   // higher coefficients are left out: they are most of the page
  // The splats' data go to files in a folder beside the page, PAGE.data, from where it loads them: for splats of any
  // size. The largest Gaussians come first, and are shown while the others are still to come.
  bool folder = false;
  uint64_t max_bytes = kMaxPageBytes;
  OutputMemory* memory = nullptr;               // the page goes there instead of a folder (io/output_memory.h)
  std::string smaller = "leave something out";  // what to do about a page above it, in the words of who asks for it
};

// One HTML file that shows the splats in any browser with WebGL 2, from disk, with no network: the clouds quantised
// (quantized_cloud.h), deflated and in base64, the page's own code beside them. The modes of rendering follow each
// cloud's `render_mode`. With ViewerPage::folder that page and a folder beside it (page_folder.h). Credits in the
// clouds' comments (core/splat_comments.h) stand on the page. Errors: kExists; kIo; kNotFound or kBadFile (a picture
// that is missing or neither PNG nor JPEG); kBadArgument: a cloud without usable Gaussians, a pixel size that is not
// positive, an `own_page` that is no such address, a page above `max_bytes`.
Status WriteViewerPage(const std::filesystem::path& path, const ViewerPage& page, const WriteOptions& options = {});

// kBadArgument: a sample of the splats shows already that a single file of them would be above `max_bytes`. The splats
// alone are looked at, and in far less time than writing takes.
Status CheckPageSize(const std::filesystem::path& path, const ViewerPage& page);

// Bytes that a splat takes in a page, from a sample of it; 0 where nothing of it can be shown. MostPageBytes: of one
// Gaussian at most, as if nothing could be compressed.
uint64_t EstimatedPageBytes(const GaussianCloud& cloud, int max_sh_degree = kMaxShDegree);
double MostPageBytes(int sh_degree);

}  // namespace anchorsplat

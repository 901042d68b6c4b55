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
  std::string name;                      // shown to people ("input.ply"); any bytes
  std::optional<uint64_t> file_bytes;    // size of the file it came from
};

// A camera to jump to, and optionally the true picture from there: PNG or JPEG, embedded unchanged.
struct ViewerView {
  Camera camera;
  std::filesystem::path picture;  // empty: none
};

// Maximum size of a page: browsers need several times that in memory.
inline constexpr uint64_t kMaxPageBytes = 300'000'000;

struct ViewerPage {
  std::string title;  // any bytes; empty: the name of `after`
  ViewerSplat after;
  std::optional<ViewerSplat> before;
  std::vector<ViewerView> views;      // the first one opens the page; without any the page chooses
  std::optional<float> pixel_size;    // world units of a training pixel at the object, for the scale bar
  std::string own_page;               // http(s) address of a page for readers' own splats; empty: none
  std::array<float, 3> background{};  // rgb 0–1
  int max_sh_degree = kMaxShDegree;   // higher coefficients are left out: they are most of the page
  // Writes the splats' data to a folder beside the page, PAGE.data, for splats of any size. The largest Gaussians come
  // first and are shown while the others load.
  bool folder = false;
  uint64_t max_bytes = kMaxPageBytes;
  OutputMemory* memory = nullptr;               // if set, the page goes there (io/output_memory.h)
  std::string smaller = "leave something out";  // advice in the error for a page above max_bytes
};

// Writes one HTML file that shows the splats in any browser with WebGL 2, from disk, without network: quantised clouds
// (quantized_cloud.h), deflated, in base64, and the page's code. Rendering follows each cloud's `render_mode`. With
// ViewerPage::folder, the page plus a folder (page_folder.h). Credits in comments (core/splat_comments.h) are shown.
// Errors: kExists; kIo; kNotFound or kBadFile: a picture missing or neither PNG nor JPEG; kBadArgument: a cloud without
// usable Gaussians, a pixel size not positive, an invalid `own_page`, a page above `max_bytes`.
Status WriteViewerPage(const std::filesystem::path& path, const ViewerPage& page, const WriteOptions& options = {});

// Checks quickly, from a sample of the splats alone, whether a single-file page certainly exceeds `max_bytes`
// (kBadArgument).
Status CheckPageSize(const std::filesystem::path& path, const ViewerPage& page);

// Estimated bytes of a splat in a page, from a sample; 0 if nothing can be shown. MostPageBytes: per Gaussian, upper
// bound without compression.
uint64_t EstimatedPageBytes(const GaussianCloud& cloud, int max_sh_degree = kMaxShDegree);
double MostPageBytes(int sh_degree);

}  // namespace anchorsplat

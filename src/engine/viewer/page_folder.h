#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "io/staged_folder.h"
#include "viewer/quantized_cloud.h"

namespace anchorsplat {

struct OutputMemory;

// Planes are deflated in pieces of this size, each a stream of its own, so that several threads write them.
inline constexpr size_t kPieceBytes = size_t{1} << 22;
// Deflated and in base64.
Result<std::vector<std::string>> PackPlanes(std::span<const uint8_t> planes);

// Gaussians in a file of the folder: whole rows of the page's textures.
inline constexpr int64_t kPartGaussians = int64_t{1} << 18;

// The folder beside a page that holds its splats: after-0.js, after-1.js, …, each with kPartGaussians, the largest
// (size × opacity) of the splat first. A page that was opened from a disk may load scripts and nothing else, so each is
// one call:
//
//   anchorsplatPart(TOKEN, "after-0", [PIECE, …])
//
// with the planes of its Gaussians in Morton order (quantized_cloud.h). The token is of the page that they belong to.
class PageFolder {
 public:
  // PAGE.data beside PAGE.html, "PAGE.data-2" where that is taken. Errors: kExists when another process is writing this
  // page; kIo.
  static Result<PageFolder> Create(const std::filesystem::path& page, OutputMemory* memory);

  // Writes the parts of a splat; what the page is told of them: [{id, file, count, token}], `file` relative to the page
  // as a URL.
  Result<nlohmann::ordered_json> AddSplat(const CloudView& cloud, MeasuredCloud measured, const std::string& id);
  // Gives the folder its name, right before the page gets its own.
  Status Publish();
  // After that. `replaced`: folders of older pages of this name are removed, with nothing but parts in them.
  void Keep(bool replaced);

 private:
  PageFolder(std::filesystem::path page, OutputMemory* memory) : page_(std::move(page)), memory_(memory) {}
  std::string FreeName() const;

  std::filesystem::path page_;
  OutputMemory* memory_;  // the files go there instead
  std::optional<StagedFolder> staged_;
  std::string name_;  // of the folder, which it will get
};

}  // namespace anchorsplat

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

// Planes are deflated in independent pieces of this size, so that several threads can work.
inline constexpr size_t kPieceBytes = size_t{1} << 22;
// Deflates the planes and encodes each piece in base64.
Result<std::vector<std::string>> PackPlanes(std::span<const uint8_t> planes);

// Gaussians per file of the folder: whole rows of the page's textures.
inline constexpr int64_t kPartGaussians = int64_t{1} << 18;

// The folder beside a page with its splats: after-0.js, after-1.js, …, each with kPartGaussians, largest (size ×
// opacity) first. A page opened from disk may load only scripts, so each file is one call,
//
//   anchorsplatPart(TOKEN, "after-0", [PIECE, …])
//
// with the planes of its Gaussians in Morton order (quantized_cloud.h). TOKEN identifies the page.
class PageFolder {
 public:
  // Creates PAGE.data beside PAGE.html, or "PAGE.data-2", … if that exists. Errors: kExists: another process is writing
  // this page; kIo.
  static Result<PageFolder> Create(const std::filesystem::path& page, OutputMemory* memory);

  // Writes a splat's parts. Returns their descriptions for the page: [{id, file, count, token}], `file` as a URL
  // relative to it.
  Result<nlohmann::ordered_json> AddSplat(const CloudView& cloud, MeasuredCloud measured, const std::string& id);
  // Renames the folder into place. Call right before the page is.
  Status Publish();
  // Call after that. `replaced`: removes folders of older pages of this name, if they contain only parts.
  void Keep(bool replaced);

 private:
  PageFolder(std::filesystem::path page, OutputMemory* memory) : page_(std::move(page)), memory_(memory) {}
  std::string FreeName() const;

  std::filesystem::path page_;
  OutputMemory* memory_;  // if set, files go there
  std::optional<StagedFolder> staged_;
  std::string name_;  // final name of the folder
};

}  // namespace anchorsplat

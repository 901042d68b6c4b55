#include "request/compare_flags.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "cameras/camera_io.h"
#include "core/file_system.h"
#include "core/text.h"
#include "images/rendering.h"
#include "io/json_file.h"
#include "metrics/compare.h"

namespace anchorsplat {

namespace {

// Rendering options have no effect if only pictures are compared.
Status CheckNothingIsRendered(const CompareFlags& flags) {
  for (const std::string& option : flags.given) {
    for (const char* name : {"orbit", "radius", "target", "fov", "size", "near", "far", "mode", "up", "profile"}) {
      if (option == name) {
        return Error{ErrorCode::kBadArgument, Cat("--", name, " has no effect on pictures; it works only with splats")};
      }
    }
  }
  return {};
}

// cc_psnr and similar names are those of gsplat and nerfstudio.
nlohmann::json ToJson(const ViewScore& score) {
  nlohmann::json json = {{"psnr", FiniteOrNull(score.psnr)}, {"ssim", score.ssim}};
  if (score.lpips) json["lpips"] = *score.lpips;
  if (score.corrected) {
    json["cc_psnr"] = FiniteOrNull(score.corrected->psnr);
    json["cc_ssim"] = score.corrected->ssim;
    if (score.corrected->lpips) json["cc_lpips"] = *score.corrected->lpips;
  }
  return json;
}

bool IsPictures(const SideInput& side) { return side.pictures || (!side.cloud && LooksLikeImages(side.path)); }

// Whether some pictures are not our own renderings.
bool NeedsPhotographs(const SideInput* side) {
  if (side->empty() || side->pictures || !IsPictures(*side)) return false;
  if (!IsFolder(side->path)) return !IsOwnRendering(side->path);
  const auto files = ListPictures(side->path);
  return files.ok() && !std::ranges::all_of(*files, IsOwnRendering);
}

}  // namespace

void CompareFlags::AddTo(CLI::App& verb) {
  verb.add_flag("--color-correct", color_correct,
                "Also measure after an affine colour correction of each view (3x3 and an offset), which removes "
                "differences in exposure and white balance");
  views.AddTo(verb);
}

Result<Sides> OpenSides(const CompareFlags& flags, SideInput a, SideInput b, SideInput truth, const CameraSet* given) {
  const SideInput& reference = truth.empty() ? b : truth;
  if (flags.color_correct && !IsPictures(reference)) {
    return Error{ErrorCode::kBadArgument, Cat("--color-correct has no effect against ",
                                              reference.cloud ? "a splat" : reference.path + ", which is a splat",
                                              "; it works only against pictures (--truth, else B)")};
  }
  const std::array<SideInput*, 3> inputs = {&a, &b, &truth};
  const GaussianCloud* first = nullptr;
  for (SideInput* side : inputs) {
    if (side->empty() || IsPictures(*side)) continue;
    if (!side->cloud) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, ReadToShow(side->path));
      side->cloud = std::make_unique<GaussianCloud>(std::move(cloud));
    }
    if (first == nullptr) first = side->cloud.get();
  }
  if (first == nullptr) ANCHORSPLAT_RETURN_IF_ERROR(CheckNothingIsRendered(flags));
  const bool has_cameras = given != nullptr || !flags.views.cameras.empty();
  // Photographs of the cameras are undistorted and masked; our own renderings are used as they are.
  std::optional<CameraSet> read;
  if (given == nullptr && has_cameras && std::ranges::any_of(inputs, NeedsPhotographs)) {
    std::filesystem::path missing;
    ANCHORSPLAT_ASSIGN_OR_RETURN(read, ReadCameras(flags.views.cameras, &missing));
    given = &*read;
  }
  std::optional<CameraSet> cameras;
  if (first != nullptr) {
    if (!has_cameras && flags.views.orbit == 0) {
      return Error{ErrorCode::kBadArgument, "comparing a splat needs views: pass --cameras FILE or --orbit N"};
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(cameras, MakeViews(flags.views, *first, given));
  } else if (has_cameras) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(cameras, MakeViews(flags.views, CloudView(), given));  // for the background
  }
  Sides sides;
  const std::array<std::unique_ptr<ViewSource>*, 3> out = {&sides.a, &sides.b, &sides.truth};
  for (size_t k = 0; k < inputs.size(); ++k) {
    SideInput& side = *inputs[k];
    if (side.empty()) continue;
    const bool is_splat = side.cloud != nullptr;
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        const RenderOptions options,
        MakeRenderOptions(flags.views, is_splat ? CloudView(*side.cloud) : CloudView(), cameras.value_or(CameraSet{})));
    if (is_splat) {
      *out[k] = MakeSplatViews(std::move(*side.cloud), *cameras, options);
    } else if (side.pictures) {
      *out[k] = std::move(side.pictures);
    } else {
      ANCHORSPLAT_ASSIGN_OR_RETURN(*out[k],
                                   OpenImageViews(side.path, options.background, cameras.value_or(CameraSet{})));
    }
    if (!is_splat && !flags.views.view.empty()) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t kept, FindView((*out[k])->names(), flags.views.view));
      (*out[k])->KeepOnly(kept);
    }
  }
  return sides;
}

ViewScore MeanOf(const Comparison& c) { return {"mean", c.mean_psnr, c.mean_ssim, c.mean_lpips, c.mean_corrected}; }

nlohmann::json ToJson(const Comparison& comparison) {
  nlohmann::json json = {{"mean", ToJson(MeanOf(comparison))}, {"views", nlohmann::json::array()}};
  for (const ViewScore& view : comparison.views) {
    json["views"].push_back(ToJson(view));
    json["views"].back()["name"] = view.name;
  }
  return json;
}

nlohmann::json ToJson(const std::vector<Comparison>& comparisons) {
  if (comparisons.size() == 1) return ToJson(comparisons[0]);
  return {{"a", ToJson(comparisons[0])}, {"b", ToJson(comparisons[1])}};
}

}  // namespace anchorsplat

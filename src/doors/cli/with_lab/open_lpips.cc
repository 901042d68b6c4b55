#include "cli/with_lab/open_lpips.h"

#include <filesystem>
#include <utility>

#include "cli/lab.h"
#include "core/log.h"
#include "core/text.h"
#include "perceptual/lpips_weights.h"

namespace anchorsplat {

Result<std::optional<Lpips>> OpenLpips(const std::string& net, const std::string& folder) {
  const bool if_there = net == kLpipsIfThere;
  const std::optional<LpipsNet> known = FindLpipsNet(if_there ? "alex" : net);
  if (!known) return std::optional<Lpips>();
  const auto missing = [&](const Error& error) -> Result<std::optional<Lpips>> {
    if (!if_there) return Error{error.code, Cat(error.message, "; --lpips if-there continues without it")};
    LogWarning(error.message);
    return std::optional<Lpips>();
  };
  const auto weights = ReadLpipsWeights(*known, folder.empty() ? LpipsFolder() : std::filesystem::path(folder));
  if (!weights.ok() && weights.error().code != ErrorCode::kNotFound) return weights.error();
  if (!weights.ok()) return missing(weights.error());
  auto lpips = Lpips::Open(*weights);
  if (!lpips.ok()) return missing(lpips.error());
  return std::optional<Lpips>(*std::move(lpips));
}

Result<PictureDistance> OpenLpipsDistance(const std::string& net, const std::string& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::optional<Lpips> lpips, OpenLpips(net, folder));
  if (!lpips) return PictureDistance();
  return PictureDistance([opened = *std::move(lpips)](const Image& picture, const Image& truth) {
    return opened.Distance(picture, truth);
  });
}

}  // namespace anchorsplat

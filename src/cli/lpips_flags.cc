#include "cli/lpips_flags.h"

#include <utility>

#include "core/log.h"
#include "request/choice.h"

namespace anchorsplat {

void AddLpipsFlags(CLI::App& verb, std::string& net, std::string& folder) {
  auto* option = verb.add_option("--lpips", net, "Perceptual distance too, by this network (papers: alex)")
                     ->check(CLI::IsMember({"alex", "vgg", "squeeze"}));
  verb.add_option("--lpips-weights", folder,
                  "Folder that scripts/fetch-lpips.sh filled (default: $ANCHORSPLAT_LPIPS, else "
                  "~/.local/share/anchorsplat/lpips)")
      ->check(NotEmpty())
      ->needs(option);
}

Result<std::optional<Lpips>> OpenLpipsOrWarn(const std::string& net, const std::string& folder) {
  const std::optional<LpipsNet> known = FindLpipsNet(net);
  if (!known) return std::optional<Lpips>();
  const auto missing = [](const Error& error) -> Result<std::optional<Lpips>> {
    if (error.code != ErrorCode::kNotFound) return error;
    LogWarning(error.message);
    return std::optional<Lpips>();
  };
  const auto weights = ReadLpipsWeights(*known, folder.empty() ? LpipsFolder() : std::filesystem::path(folder));
  if (!weights.ok()) return missing(weights.error());
  auto lpips = Lpips::Open(*weights);
  if (!lpips.ok()) return missing(lpips.error());
  return std::optional<Lpips>(*std::move(lpips));
}

}  // namespace anchorsplat

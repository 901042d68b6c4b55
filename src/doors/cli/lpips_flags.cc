#include "cli/lpips_flags.h"

#include <utility>

#include "core/log.h"
#include "core/text.h"
#include "request/choice.h"

namespace anchorsplat {

namespace {

constexpr const char* kIfThere = "if-there";

}  // namespace

void AddLpipsFlags(CLI::App& verb, std::string& net, std::string& folder) {
  auto* option =
      verb.add_option("--lpips", net, "Perceptual distance too, by this network (papers: alex), or by alex if-there")
          ->check(CLI::IsMember({"alex", "vgg", "squeeze", kIfThere}));
  verb.add_option("--lpips-weights", folder,
                  "Folder that scripts/fetch-lpips.sh filled (default: $ANCHORSPLAT_LPIPS, else "
                  "~/.local/share/anchorsplat/lpips)")
      ->check(NotEmpty())
      ->needs(option);
}

Result<std::optional<Lpips>> OpenLpips(const std::string& net, const std::string& folder) {
  const bool if_there = net == kIfThere;
  const std::optional<LpipsNet> known = FindLpipsNet(if_there ? "alex" : net);
  if (!known) return std::optional<Lpips>();
  const auto missing = [&](const Error& error) -> Result<std::optional<Lpips>> {
    if (error.code != ErrorCode::kNotFound) return error;
    if (!if_there) return Error{error.code, Cat(error.message, "; --lpips if-there goes on without")};
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

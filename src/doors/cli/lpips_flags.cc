#include "cli/lab.h"
#include "request/choice.h"

namespace anchorsplat {

void AddLpipsFlags(CLI::App& verb, std::string& net, std::string& folder) {
  auto* option =
      verb.add_option("--lpips", net, "Perceptual distance too, by this network (papers: alex), or by alex if-there")
          ->check(CLI::IsMember({"alex", "vgg", "squeeze", kLpipsIfThere}));
  verb.add_option("--lpips-weights", folder,
                  "Folder that scripts/fetch-lpips.sh filled (default: $ANCHORSPLAT_LPIPS, else "
                  "~/.local/share/anchorsplat/lpips)")
      ->check(NotEmpty())
      ->needs(option);
}

}  // namespace anchorsplat

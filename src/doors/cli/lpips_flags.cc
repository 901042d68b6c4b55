#include "cli/lab.h"
#include "request/choice.h"

namespace anchorsplat {

void AddLpipsFlags(CLI::App& verb, std::string& net, std::string& folder) {
  auto* option = verb.add_option("--lpips", net,
                                 "Also measure LPIPS with this network (papers: alex). if-there: alex, if installed")
                     ->check(OneOf({"alex", "vgg", "squeeze", kLpipsIfThere}));
  verb.add_option("--lpips-weights", folder,
                  "Folder that scripts/fetch-lpips.sh filled (default: $ANCHORSPLAT_LPIPS, else "
                  "~/.local/share/anchorsplat/lpips)")
      ->type_name("FOLDER")
      ->check(NotEmpty())
      ->needs(option);
}

}  // namespace anchorsplat

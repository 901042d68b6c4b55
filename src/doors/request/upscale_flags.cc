#include "request/upscale_flags.h"

#include <nlohmann/json.hpp>

#include "core/text.h"
#include "request/choice.h"
#include "request/parse.h"

namespace anchorsplat {

void UpscaleFlags::AddTo(CLI::App& verb) {
  verb.add_option("--network", network, "Network to use, a .safetensors of scripts/fetch-upscaler.sh")
      ->type_name("FILE")
      ->required()
      ->check(NotEmpty());
  verb.add_option("--factor", factor, "Enlargement, a power of the network's factor (default: the network's factor)")
      ->check(CLI::Range(2, 16));
  verb.add_option("--background", background, "R,G,B from 0 to 1 behind pictures with alpha (default: black)")
      ->type_name("R,G,B");
  AddChoice(verb, "--alpha", alpha, {{"network", AlphaEnlargement::kNetwork}, {"bicubic", AlphaEnlargement::kBicubic}},
            "How to enlarge alpha; bicubic takes half the time and has softer edges");
}

Result<EnlargeOptions> MakeEnlargeOptions(const UpscaleFlags& flags, const UpscalerInfo& network) {
  EnlargeOptions options{.factor = flags.factor, .alpha = flags.alpha};
  if (!flags.background.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.background, ParseColor("--background", flags.background));
  }
  if (const auto times = TimesOf(flags.factor, network.scale); !times.ok()) {
    return Error{times.error().code, Cat("--factor: ", times.error().message)};
  }
  if (options.factor == 0) options.factor = network.scale;
  return options;
}

nlohmann::json ToJson(const UpscalerInfo& network) {
  return {{"architecture", network.architecture},
          {"scale", network.scale},
          {"source", network.source},
          {"licence", network.licence}};
}

std::string EnlargedComment(const UpscalerInfo& network, int factor) {
  return Cat("Enlarged ", factor, " times by a network (", network.architecture, "), which invented the detail.");
}

}  // namespace anchorsplat

#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/result.h"
#include "upscale/enlarge_picture.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

// The options of `upscale` that say how.
struct UpscaleFlags {
  std::string network;     // a file that scripts/fetch-upscaler.sh makes
  int factor = 0;          // 0: the network's
  std::string background;  // "R,G,B"; empty: black
  AlphaEnlargement alpha = AlphaEnlargement::kNetwork;

  void AddTo(CLI::App& verb);
};

// Errors name the option.
Result<EnlargeOptions> MakeEnlargeOptions(const UpscaleFlags& flags, const UpscalerInfo& network);

// Of the network: architecture, scale, source, licence.
nlohmann::json ToJson(const UpscalerInfo& network);

// What a picture that a network enlarged says of itself.
std::string EnlargedComment(const UpscalerInfo& network, int factor);

}  // namespace anchorsplat

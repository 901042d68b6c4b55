#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/result.h"
#include "upscale/enlarge_picture.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

// How to upscale.
struct UpscaleFlags {
  std::string network;     // file of scripts/fetch-upscaler.sh
  int factor = 0;          // 0: the network's
  std::string background;  // "R,G,B"; empty: black
  AlphaEnlargement alpha = AlphaEnlargement::kNetwork;

  void AddTo(CLI::App& verb);
};

// Errors name the option.
Result<EnlargeOptions> MakeEnlargeOptions(const UpscaleFlags& flags, const UpscalerInfo& network);

// Architecture, scale, source and licence of the network.
nlohmann::json ToJson(const UpscalerInfo& network);

// Comment stored in an enlarged picture.
std::string EnlargedComment(const UpscalerInfo& network, int factor);

}  // namespace anchorsplat

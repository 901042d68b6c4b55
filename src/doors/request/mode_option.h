#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/render_mode.h"

namespace anchorsplat {

// --mode: how a splat is rasterized, by the words of NameOf.
inline CLI::Option* AddModeOption(CLI::App& verb, std::optional<RenderMode>& mode, const std::string& help) {
  std::vector<std::string> words;
  for (const RenderMode known : kRenderModes) words.emplace_back(NameOf(known));
  const auto assign = [&mode](const std::string& word) { mode = RenderModeNamed(word); };
  return verb.add_option_function<std::string>("--mode", assign, help)->check(OneOf(words));
}

}  // namespace anchorsplat

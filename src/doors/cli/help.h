#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace anchorsplat {

// Gives `app` and the verbs that are added to it later `--help` and `--help-all`.
void AddHelp(CLI::App& app);

// `--help` of this verb shows only these options ("--output"), in this order, behind the positional ones; `--help-all`
// shows every option, in groups. Without a call both show every option.
void ShortenHelp(CLI::App& verb, std::vector<std::string> options);

}  // namespace anchorsplat

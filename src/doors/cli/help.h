#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace anchorsplat {

// Adds `--help` and `--help-all` to `app` and to verbs added later.
void AddHelp(CLI::App& app);

// Makes `--help` of this verb show only these options ("--output"), in this order, after the positional ones.
// `--help-all` shows all in groups; without this call so does `--help`.
void ShortenHelp(CLI::App& verb, std::vector<std::string> options);

}  // namespace anchorsplat

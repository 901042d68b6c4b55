#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// Checks that a command line begins with a verb of `app`, and with a subcommand if the verb has some. The error
// (kBadArgument) lists the verbs and suggests the nearest. `words` is argv; CLI11 checks the options.
Status CheckVerbWords(const CLI::App& app, std::span<const std::string> words);

// "'anchorsplat info' has no option '--jsn'; did you mean '--json'?" for the first unknown long option; empty if all
// are known.
std::string UnknownOption(const CLI::App& app, std::span<const std::string> words);

// The same words with "-o=page.html" as "--output=page.html": CLI11 would take the = as part of the value, or, after a
// flag, as another flag.
std::vector<std::string> WithLongNames(const CLI::App& app, std::span<const std::string> words);

}  // namespace anchorsplat

#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// Names of the options that the user gave, without dashes.
std::vector<std::string> GivenOptions(const CLI::App& verb);

// Parses the words of a request ("--upscale=2") with the options declared for `verb`, so with the checks and messages
// of the command line. Errors: kBadArgument.
Status ParseWords(CLI::App& verb, std::vector<std::string> words);

}  // namespace anchorsplat

#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// The options that the user gave, by their names without dashes.
std::vector<std::string> GivenOptions(const CLI::App& verb);

// Reads the words of a request ("--upscale=2") into what was declared for `verb`, with the checks and in the words of
// the command line. Errors: kBadArgument.
Status ParseWords(CLI::App& verb, std::vector<std::string> words);

}  // namespace anchorsplat

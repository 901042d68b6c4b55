#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// That the words of a command line begin with a verb of `app`, and with one of its subcommands where it has some. The
// error (kBadArgument) names the verbs there are and the one nearest to what was typed. `words` is argv; options are
// left to the library.
Status CheckVerbWords(const CLI::App& app, std::span<const std::string> words);

// The same words, where "-o=page.html" says "--output=page.html": the library would take the = for a part of the value,
// and behind a flag for another flag.
std::vector<std::string> WithLongNames(const CLI::App& app, std::span<const std::string> words);

// How many letters have to be changed, added, left out or exchanged with their neighbour to make `b` of `a`.
size_t EditDistance(std::string_view a, std::string_view b);

}  // namespace anchorsplat

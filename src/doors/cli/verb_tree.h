#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace anchorsplat {

// The declared command line. --help, the man page and completions are all made from it, so they agree.

struct DeclaredOption {
  std::vector<std::string> names;    // "-o", "--output"; empty for a positional one
  std::string positional;            // "inputs", for a positional one
  std::string group;                 // heading in --help
  std::string value;                 // "FILE", "INT"; empty for a flag
  std::vector<std::string> choices;  // all words that it takes, if limited
  std::string range;                 // "[0 - 1024]", if bounded
  std::string default_value;
  std::string description;
  bool required = false;
  bool many = false;  // more than one value
};

struct DeclaredVerb {
  std::vector<std::string> words;  // {"dataset", "build"}
  std::string description;
  std::string footer;                   // the example
  std::vector<DeclaredOption> options;  // none if there are subcommands
  std::vector<DeclaredVerb> verbs;

  std::string name(const char* between = " ") const;  // "dataset build"
};

inline constexpr const char* kSharedFlagsGroup = "Shared flags";

// Without hidden verbs, hidden options, --help and --help-all.
std::vector<DeclaredVerb> DeclaredVerbs(const CLI::App& app);
// `verb` itself; the whole program has no `words`.
DeclaredVerb DeclaredBy(const CLI::App& verb);

// roff of the manual page anchorsplat(1).
std::string ManPage(const CLI::App& app);

// What `bash` and `zsh` complete words with.
std::string BashCompletion(const CLI::App& app);
std::string ZshCompletion(const CLI::App& app);

}  // namespace anchorsplat

#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace anchorsplat {

// The command line as it was declared, for all that is written about it: man page and completions come from here, so
// that they cannot tell anything else than --help.

struct DeclaredOption {
  std::vector<std::string> names;    // "-o", "--output"; empty for a positional one
  std::string positional;            // "inputs", for a positional one
  std::string group;                 // as --help heads it
  std::string value;                 // "TEXT", "INT"; empty for a flag
  std::vector<std::string> choices;  // the words that it takes, where these are all
  std::string range;                 // "[0 - 1024]", where it is bounded
  std::string default_value;
  std::string description;
  bool required = false;
  bool many = false;  // more than one value
};

struct DeclaredVerb {
  std::vector<std::string> words;  // {"dataset", "build"}
  std::string description;
  std::string footer;                   // the example
  std::vector<DeclaredOption> options;  // none where there are verbs below
  std::vector<DeclaredVerb> verbs;

  std::string name(const char* between = " ") const;  // "dataset build"
};

inline constexpr const char* kSharedFlagsGroup = "Shared flags";

// Hidden verbs and options are left out, --help and --help-all too.
std::vector<DeclaredVerb> DeclaredVerbs(const CLI::App& app);
// `verb` itself; the program has no words.
DeclaredVerb DeclaredBy(const CLI::App& verb);

// roff of the manual page anchorsplat(1).
std::string ManPage(const CLI::App& app);

// What `bash` and `zsh` complete words with.
std::string BashCompletion(const CLI::App& app);
std::string ZshCompletion(const CLI::App& app);

}  // namespace anchorsplat

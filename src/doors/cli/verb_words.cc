#include "cli/verb_words.h"

#include <algorithm>

#include "cli/verb_tree.h"
#include "core/text.h"
#include "request/choice.h"

namespace anchorsplat {

namespace {

// Without hidden ones.
std::vector<std::string> Verbs(const CLI::App& app) {
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App* v) { return !v->get_group().empty(); })) {
    verbs.push_back(verb->get_name());
  }
  return verbs;
}

// Without dashes.
std::vector<std::string> LongNames(const CLI::App& verb) {
  std::vector<std::string> names = {"help", "help-all"};
  for (const DeclaredOption& option : DeclaredBy(verb).options) {
    for (const std::string& name : option.names) {
      if (name.starts_with("--")) names.push_back(name.substr(2));
    }
  }
  return names;
}

}  // namespace

Status CheckVerbWords(const CLI::App& app, std::span<const std::string> words) {
  const CLI::App* at = &app;
  std::string said = app.get_name();
  for (size_t k = 1;; ++k) {
    const std::vector<std::string> verbs = Verbs(*at);
    if (verbs.empty() || (k < words.size() && words[k].starts_with('-'))) return {};
    std::string list;
    for (const std::string& verb : verbs) list += (list.empty() ? "" : ", ") + verb;
    if (k >= words.size()) {
      return Error{ErrorCode::kBadArgument, Cat("'", said, "' needs a verb: ", list, " (--help shows more)")};
    }
    const CLI::App* next = nullptr;  // may be hidden
    for (const CLI::App* verb : at->get_subcommands([](const CLI::App*) { return true; })) {
      if (verb->check_name(words[k])) next = verb;
    }
    if (next == nullptr) {
      const std::string nearest = Nearest(words[k], verbs);
      return Error{ErrorCode::kBadArgument, Cat("'", said, "' has no verb '", Printable(words[k]), "'",
                                                nearest.empty() ? "." : Cat("; did you mean '", nearest, "'?"),
                                                " There are ", list, " (--help shows more)")};
    }
    at = next;
    said += " " + words[k];
  }
}

std::string UnknownOption(const CLI::App& app, std::span<const std::string> words) {
  const CLI::App* verb = &app;
  std::string said = app.get_name();
  for (const std::string& word : words.subspan(std::min<size_t>(1, words.size()))) {
    if (word == "--") break;
    for (const CLI::App* next : verb->get_subcommands([&](const CLI::App* v) { return v->check_name(word); })) {
      verb = next;
      said += " " + word;
    }
    if (!word.starts_with("--")) continue;
    const std::string name = word.substr(0, word.find('='));
    if (verb->get_option_no_throw(name) != nullptr) continue;
    const std::string nearest = Nearest(name.substr(2), LongNames(*verb));
    return Cat("'", said, "' has no option '", Printable(name), "'",
               nearest.empty() ? "" : Cat("; did you mean '--", nearest, "'?"));
  }
  return {};
}

std::vector<std::string> WithLongNames(const CLI::App& app, std::span<const std::string> words) {
  std::vector<std::string> said(words.begin(), words.end());
  const CLI::App* verb = &app;
  for (std::string& word : said) {
    if (word == "--") break;
    for (const CLI::App* next : verb->get_subcommands([&](const CLI::App* v) { return v->check_name(word); })) {
      verb = next;
    }
    if (word.size() < 3 || word[0] != '-' || word[1] == '-' || word[2] != '=') continue;
    const CLI::Option* const option = verb->get_option_no_throw(word.substr(0, 2));
    if (option != nullptr && !option->get_lnames().empty()) word = Cat("--", option->get_lnames()[0], word.substr(2));
  }
  return said;
}

}  // namespace anchorsplat

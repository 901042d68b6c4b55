#include "cli/help.h"

#include <algorithm>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "cli/table.h"
#include "cli/verb_tree.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr size_t kHelpWidth = 100;        // columns of the screen
constexpr size_t kDescriptionsFrom = 30;  // column

// `text` in lines, the first of which begins at column `at`, the others at kDescriptionsFrom.
std::string WrappedDescription(std::string_view text, size_t at) {
  std::string out;
  size_t column = at;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find(' ', begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    const bool first = begin == 0;
    if (!first && column + 1 + DisplayWidth(word) > kHelpWidth) {
      out += "\n" + std::string(kDescriptionsFrom, ' ');
      column = kDescriptionsFrom;
    } else if (!first) {
      out += ' ';
      ++column;
    }
    out += word;
    column += DisplayWidth(word);
    begin = end + 1;
  }
  return out + "\n";
}

// Names on the left, description on the right; long names get a line of their own.
std::string HelpEntry(const std::string& left, const std::string& right) {
  std::string out = "  " + left;
  if (right.empty()) return out + "\n";
  const size_t width = DisplayWidth(out);
  out += width + 2 > kDescriptionsFrom ? "\n" + std::string(kDescriptionsFrom, ' ')
                                       : std::string(kDescriptionsFrom - width, ' ');
  return out + WrappedDescription(right, kDescriptionsFrom);
}

std::string NamesAndValue(const DeclaredOption& option) {
  if (!option.positional.empty()) return option.positional + (option.many ? "..." : "");
  std::string name;
  for (const std::string& one : option.names) name += (name.empty() ? "" : ", ") + one;
  if (option.names.front().starts_with("--")) name.insert(0, "    ");  // below those with a letter
  if (!option.choices.empty()) {
    std::string words;
    for (const std::string& choice : option.choices) words += (words.empty() ? "" : "|") + choice;
    return name + " " + words;
  }
  if (option.value.empty()) return name;
  const bool number = option.value == "INT" || option.value == "UINT" || option.value == "FLOAT";
  return name + " " + (number ? "N" : option.value) + (option.many ? "..." : "");
}

std::string HelpEntry(const DeclaredOption& option) {
  std::string text = option.description;
  if (!option.default_value.empty()) text += Cat(" (default: ", option.default_value, ")");
  if (option.required && option.positional.empty()) text += " (required)";
  return HelpEntry(NamesAndValue(option), text);
}

std::string UsageOf(const DeclaredVerb& verb) {
  std::string out = "\nUsage: anchorsplat";
  if (!verb.words.empty()) out += " " + verb.name();
  if (!verb.verbs.empty()) return out + " VERB [OPTIONS]\n";
  for (const DeclaredOption& option : verb.options) {
    if (!option.positional.empty())
      out += option.required ? " " + NamesAndValue(option) : " [" + NamesAndValue(option) + "]";
  }
  return out + " [OPTIONS]\n";
}

std::string OptionGroups(std::span<const DeclaredOption> options) {
  std::vector<std::string> groups;
  for (const DeclaredOption& option : options) {
    if (option.positional.empty() && std::ranges::find(groups, option.group) == groups.end()) {
      groups.push_back(option.group);
    }
  }
  // Shared flags come last.
  if (const auto shared = std::ranges::find(groups, kSharedFlagsGroup); shared != groups.end()) {
    std::rotate(shared, shared + 1, groups.end());
  }
  std::string out;
  for (const std::string& group : groups) {
    out += "\n" + group + ":\n";
    for (const DeclaredOption& option : options) {
      if (option.positional.empty() && option.group == group) out += HelpEntry(option);
    }
  }
  return out;
}

class VerbHelp : public CLI::FormatterBase {
 public:
  VerbHelp() = default;
  explicit VerbHelp(std::vector<std::string> options) : options_(std::move(options)) {}

  std::string make_help(const CLI::App* app, std::string /*name*/, CLI::AppFormatMode mode) const override {
    const DeclaredVerb verb = DeclaredBy(*app);
    std::string out = verb.description + "\n" + UsageOf(verb);
    for (const DeclaredOption& option : verb.options) {
      if (!option.positional.empty()) out += (&option == &verb.options.front() ? "\n" : "") + HelpEntry(option);
    }
    const bool all = mode != CLI::AppFormatMode::Normal || options_.empty();
    out += all ? OptionGroups(verb.options) : Chosen(verb);
    if (!verb.verbs.empty()) out += VerbsBelow(*app, verb, mode);
    if (!verb.footer.empty()) out += "\n" + verb.footer + "\n";
    return out;
  }

 private:
  std::string Chosen(const DeclaredVerb& verb) const {
    std::string out = "\n";
    for (const std::string& name : options_) {
      for (const DeclaredOption& option : verb.options) {
        if (std::ranges::find(option.names, name) != option.names.end()) out += HelpEntry(option);
      }
    }
    return out + HelpEntry("    --help-all", "Show all options");
  }

  static std::string VerbsBelow(const CLI::App& app, const DeclaredVerb& verb, CLI::AppFormatMode mode) {
    std::string out = mode == CLI::AppFormatMode::Normal ? "\nVerbs:\n" : "";
    for (const DeclaredVerb& below : verb.verbs) {
      if (mode == CLI::AppFormatMode::Normal) {
        out += HelpEntry(below.words.back(), below.description);
      } else {
        const CLI::App* const next = app.get_subcommand(below.words.back());
        out += "\n" + next->help("", mode);
      }
    }
    if (mode == CLI::AppFormatMode::Normal && app.get_parent() == nullptr) out += OtherVerbs(app);
    return out;
  }

  // Those without the shared flags.
  static std::string OtherVerbs(const CLI::App& app) {
    std::string out;
    for (const CLI::App* verb : app.get_subcommands([](const CLI::App* v) { return v->get_group().empty(); })) {
      out += HelpEntry(verb->get_name(), verb->get_description());
    }
    return out.empty() ? out : "\nOther verbs:\n" + out;
  }

  std::vector<std::string> options_;
};

}  // namespace

void AddHelp(CLI::App& app) {
  app.formatter(std::make_shared<VerbHelp>());
  app.set_help_flag("-h,--help", "Show the options most often used, and exit");
  app.set_help_all_flag("--help-all", "Show all options, and exit");
}

void ShortenHelp(CLI::App& verb, std::vector<std::string> options) {
  for (const std::string& name : options) static_cast<void>(verb.get_option(name));  // throws where there is none
  verb.formatter(std::make_shared<VerbHelp>(std::move(options)));
}

}  // namespace anchorsplat

#include <set>

#include "cli/exit_codes.h"
#include "cli/verb_tree.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

// Escapes text for roff: hyphens as \-, and no line begins like a request.
std::string Roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) {
      out += std::string("\\&") + c;
    } else {
      out += c;
    }
  }
  return out;
}

std::string Sentence(const std::string& text) {
  const bool ends = text.empty() || text.ends_with('.') || text.ends_with('?') || text.ends_with(':');
  return Roff(text) + (ends ? "\n" : ".\n");
}

void AddOption(const DeclaredOption& option, std::string& out) {
  out += ".TP\n";
  if (!option.positional.empty()) {
    out += "\\fI" + Roff(option.positional) + "\\fR" + (option.many ? " ..." : "");
  }
  for (size_t i = 0; i < option.names.size(); ++i) {
    out += (i > 0 ? ", \\fB" : "\\fB") + Roff(option.names[i]) + "\\fR";
  }
  if (!option.choices.empty()) {
    std::string words;
    for (const std::string& choice : option.choices) words += (words.empty() ? "" : "|") + choice;
    out += " " + Roff(words);
  } else if (!option.names.empty() && !option.value.empty()) {
    out += " \\fI" + Roff(option.value) + "\\fR" + (option.many ? " ..." : "");
  }
  out += "\n" + Sentence(option.description);
  if (option.required) out += "Required.\n";
  if (!option.range.empty()) out += "In " + Roff(option.range) + ".\n";
  if (!option.default_value.empty()) out += "Default: " + Roff(option.default_value) + ".\n";
}

void AddGroups(const std::vector<DeclaredOption>& options, std::string& out) {
  std::vector<std::string> groups;
  std::set<std::string> seen = {kSharedFlagsGroup};
  for (const DeclaredOption& option : options) {
    if (seen.insert(option.group).second) groups.push_back(option.group);
  }
  for (const std::string& group : groups) {
    // CLI11's name for options without a group.
    if (group != "Options") out += ".SS \"" + Roff(group) + "\"\n";
    for (const DeclaredOption& option : options) {
      if (option.group == group) AddOption(option, out);
    }
  }
}

void AddVerbSection(const DeclaredVerb& verb, std::string& out) {
  if (verb.verbs.empty()) {
    out += ".SH \"" + Roff("anchorsplat " + verb.name()) + "\"\n" + Sentence(verb.description);
    AddGroups(verb.options, out);
    if (!verb.footer.empty()) {
      const size_t line = verb.footer.find('\n');
      out += ".PP\n" + Roff(verb.footer.substr(0, line)) + "\n";
      if (line != std::string::npos) out += ".PP\n.nf\n" + Roff(verb.footer.substr(line + 1)) + "\n.fi\n";
    }
  }
  for (const DeclaredVerb& below : verb.verbs) AddVerbSection(below, out);
}

void AddSummary(const DeclaredVerb& verb, std::string& out) {
  if (verb.verbs.empty()) out += ".TP\n\\fB" + Roff(verb.name()) + "\\fR\n" + Sentence(verb.description);
  for (const DeclaredVerb& below : verb.verbs) AddSummary(below, out);
}

}  // namespace

std::string ManPage(const CLI::App& app) {
  const std::vector<DeclaredVerb> verbs = DeclaredVerbs(app);
  const std::string purpose = app.get_description();
  const size_t colon = purpose.find(": ");
  std::string out = Cat(".\\\" Made by the program itself from what its verbs say about themselves.\n",
                        ".TH ANCHORSPLAT 1 \"\" \"anchorsplat ", ANCHORSPLAT_VERSION, "\" \"User Commands\"\n");
  out += ".SH NAME\nanchorsplat \\- " + Roff(colon == std::string::npos ? purpose : purpose.substr(colon + 2)) + "\n";
  out +=
      ".SH SYNOPSIS\n\\fBanchorsplat\\fR \\fIVERB\\fR [\\fIOPTIONS\\fR] ...\n.br\n"
      "\\fBanchorsplat\\fR \\fIVERB\\fR \\fB\\-\\-help\\fR | \\fB\\-\\-help\\-all\\fR\n.br\n\\fBanchorsplat "
      "\\-\\-version\\fR\n";
  out += ".SH VERBS\n";
  for (const DeclaredVerb& verb : verbs) AddSummary(verb, out);
  out += ".SH \"FLAGS OF EVERY VERB\"\n";
  for (const DeclaredOption& option : verbs.front().options) {
    if (option.group == kSharedFlagsGroup) AddOption(option, out);
  }
  for (const DeclaredVerb& verb : verbs) AddVerbSection(verb, out);
  out += ".SH \"EXIT STATUS\"\n";
  for (const ExitCodeMeaning& meaning : ExitCodeMeanings()) {
    out += Cat(".TP\n.B ", meaning.code, "\n") + Sentence(meaning.meaning);
  }
  out += ".SH ENVIRONMENT\n.TP\n.B ANCHORSPLAT_LPIPS\n" +
         Sentence("The folder with the trained weights of LPIPS, otherwise ~/.local/share/anchorsplat/lpips");
  return out;
}

}  // namespace anchorsplat

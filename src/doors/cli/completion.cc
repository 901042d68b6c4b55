#include "cli/verb_tree.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

// Within single quotes of a shell.
std::string Quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string Joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : " ") + word;
  return out;
}

// The words after `verb` that are options or verbs below it.
std::vector<std::string> NextWords(const DeclaredVerb& verb) {
  std::vector<std::string> words = {"--help", "--help-all"};
  for (const DeclaredVerb& below : verb.verbs) words.push_back(below.words.back());
  for (const DeclaredOption& option : verb.options) words.insert(words.end(), option.names.begin(), option.names.end());
  return words;
}

void AddBashVerb(const DeclaredVerb& verb, std::string& path, std::string& words, std::string& values) {
  std::vector<std::string> above = verb.words;
  above.pop_back();
  path += Cat("      ", Quoted(Joined(above) + " " + verb.words.back()), ") verb=", Quoted(verb.name()), " ;;\n");
  // Where verbs follow there is nothing else to say.
  words += Cat("    ", Quoted(verb.name()),
               verb.verbs.empty() ? ") words=" : ") values=", Quoted(Joined(NextWords(verb))), " ;;\n");
  for (const DeclaredOption& option : verb.options) {
    if (option.choices.empty() || option.names.empty()) continue;
    std::string patterns;
    for (const std::string& name : option.names) {
      patterns += (patterns.empty() ? "" : "|") + Quoted(verb.name() + " " + name);
    }
    values += Cat("    ", patterns, ") values=", Quoted(Joined(option.choices)), " ;;\n");
  }
  for (const DeclaredVerb& below : verb.verbs) AddBashVerb(below, path, words, values);
}

// In the brackets and between the colons of a specification of _arguments.
std::string ZshText(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string ZshValue(const DeclaredOption& option, const std::string& name) {
  if (!option.choices.empty()) return ":" + name + ":(" + ZshText(Joined(option.choices)) + ")";
  if (option.value.empty()) return "";
  if (option.value == "FOLDER") return ":" + name + ":_files -/";
  return ":" + name + (option.value == "FILE" || option.value == "PATH" ? ":_files" : ":");
}

std::string ZshFunction(const DeclaredVerb& verb) { return "_anchorsplat_" + verb.name("_"); }

void AddZshVerb(const DeclaredVerb& verb, std::string& out) {
  out += ZshFunction(verb) + "() {\n";
  if (!verb.verbs.empty()) {
    out += "  if (( CURRENT == 2 )); then\n    local -a verbs\n    verbs=(\n";
    for (const DeclaredVerb& below : verb.verbs) {
      out += Cat("      ", Quoted(ZshText(below.words.back()) + ":" + below.description), "\n");
    }
    out += "    )\n    _describe verb verbs\n    return\n  fi\n  shift words\n  (( CURRENT-- ))\n  case $words[1] in\n";
    for (const DeclaredVerb& below : verb.verbs) {
      out += Cat("    ", below.words.back(), ") ", ZshFunction(below), " ;;\n");
    }
    out += "  esac\n}\n";
    for (const DeclaredVerb& below : verb.verbs) AddZshVerb(below, out);
    return;
  }
  out += "  _arguments -s '--help[Show the options most often used]' '--help-all[Show all options]'";
  for (const DeclaredOption& option : verb.options) {
    if (option.names.empty()) {
      const std::string prefix = option.many ? "*" : "";
      out += " \\\n    " + Quoted(prefix + ":" + option.positional + ":_files");
      continue;
    }
    // All names of an option exclude each other, unless it may be given several times.
    const std::string others = option.many ? "*" : "(" + Joined(option.names) + ")";
    for (const std::string& name : option.names) {
      out += " \\\n    " + Quoted(others + name + "[" + ZshText(option.description) + "]" + ZshValue(option, "value"));
    }
  }
  out += "\n}\n";
}

}  // namespace

std::string BashCompletion(const CLI::App& app) {
  std::string path, words, values;
  std::vector<std::string> first = {"--help", "--help-all", "--version"};
  for (const DeclaredVerb& verb : DeclaredVerbs(app)) {
    AddBashVerb(verb, path, words, values);
    first.push_back(verb.words.back());
  }
  return Cat(
      "# Completion of anchorsplat for bash, made by the program itself.\n"
      "_anchorsplat() {\n"
      "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}\n"
      "  local verb= words= values= i\n"
      "  # bash takes --name=value for three words.\n"
      "  if [ \"$current\" = = ]; then current=; previous=${COMP_WORDS[COMP_CWORD-1]}\n"
      "  elif [ \"$previous\" = = ]; then previous=${COMP_WORDS[COMP_CWORD-2]}; fi\n"
      "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
      "    case \"$verb ${COMP_WORDS[i]}\" in\n",
      path,
      "    esac\n"
      "  done\n"
      "  case \"$verb\" in\n    '') values=",
      Quoted(Joined(first)), " ;;\n", words,
      "  esac\n"
      "  case \"$verb $previous\" in\n",
      values,
      "  esac\n"
      "  if [ -n \"$values\" ]; then\n"
      "    COMPREPLY=($(compgen -W \"$values\" -- \"$current\"))\n"
      "  elif [[ $current == -* ]]; then\n"
      "    COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
      "  fi  # else names of files, by -o default\n"
      "}\n"
      "complete -o default -F _anchorsplat anchorsplat\n");
}

std::string ZshCompletion(const CLI::App& app) {
  DeclaredVerb root;
  root.verbs = DeclaredVerbs(app);
  std::string out = "#compdef anchorsplat\n# Completion of anchorsplat for zsh, made by the program itself.\n";
  AddZshVerb(root, out);
  return out + ZshFunction(root) + " \"$@\"\n";
}

}  // namespace anchorsplat

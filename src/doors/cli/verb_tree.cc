#include "cli/verb_tree.h"

#include <utility>

#include "core/text.h"

namespace anchorsplat {

namespace {

// "TEXT:{a,b}" as CLI::IsMember names the type.
std::vector<std::string> ChoicesOf(const std::string& type) {
  const size_t begin = type.find('{'), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

DeclaredOption Declared(const CLI::Option& option) {
  DeclaredOption out;
  if (option.get_positional()) {
    out.positional = option.get_name(/*positional=*/true);
  } else {
    for (const std::string& name : option.get_snames()) out.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) out.names.push_back("--" + name);
  }
  out.group = option.get_group();
  out.description = option.get_description();
  out.required = option.get_required();
  if (option.get_type_size() == 0) return out;
  const std::string type = option.get_type_name();
  out.choices = ChoicesOf(type);
  out.value = type.substr(0, type.find_first_of(": "));
  if (const size_t in = type.find(" in ["); in != std::string::npos) {
    out.range = type.substr(in + 4, type.find(']', in) - in - 3);
  }
  out.default_value = option.get_default_str();
  out.many = option.get_expected_max() > 1;
  return out;
}

DeclaredVerb Declared(const CLI::App& app, std::vector<std::string> words) {
  DeclaredVerb out;
  out.words = std::move(words);
  out.description = app.get_description();
  out.footer = app.get_footer();
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App* v) { return !v->get_group().empty(); })) {
    std::vector<std::string> below = out.words;
    below.push_back(verb->get_name());
    out.verbs.push_back(Declared(*verb, std::move(below)));
  }
  for (const CLI::Option* option : app.get_options()) {
    const bool help = option == app.get_help_ptr() || option == app.get_help_all_ptr();
    if (!help && !option->get_group().empty()) out.options.push_back(Declared(*option));
  }
  return out;
}

}  // namespace

std::string DeclaredVerb::name(const char* between) const {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : between) + word;
  return out;
}

std::vector<DeclaredVerb> DeclaredVerbs(const CLI::App& app) { return Declared(app, {}).verbs; }

DeclaredVerb DeclaredBy(const CLI::App& verb) {
  std::vector<std::string> words;
  for (const CLI::App* at = &verb; at->get_parent() != nullptr; at = at->get_parent()) {
    words.insert(words.begin(), at->get_name());
  }
  return Declared(verb, std::move(words));
}

}  // namespace anchorsplat

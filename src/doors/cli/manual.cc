#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/verb.h"
#include "cli/verb_tree.h"
#include "request/choice.h"

namespace anchorsplat {

namespace {

nlohmann::json ToJson(const std::vector<DeclaredVerb>& verbs) {
  nlohmann::json json = nlohmann::json::object();
  for (const DeclaredVerb& verb : verbs) {
    nlohmann::json& told = json[verb.words.back()];
    told["description"] = verb.description;
    if (!verb.verbs.empty()) told["verbs"] = ToJson(verb.verbs);
    told["options"] = nlohmann::json::array();
    for (const DeclaredOption& option : verb.options) {
      told["options"].push_back({{"names", option.names},
                                 {"positional", option.positional},
                                 {"group", option.group},
                                 {"value", option.value},
                                 {"choices", option.choices},
                                 {"range", option.range},
                                 {"default", option.default_value},
                                 {"description", option.description},
                                 {"required", option.required},
                                 {"many", option.many}});
    }
  }
  return json;
}

}  // namespace

// Used by the build, which installs the output.
void AddManual(CLI::App& app, Program& program) {
  CLI::App& verb =
      *app.add_subcommand("manual", "Print the manual page, shell completion, or all verbs and options as JSON");
  verb.group("");
  const auto kind = std::make_shared<std::string>();
  verb.add_option("kind", *kind, "What to print")->required()->check(OneOf({"man", "bash", "zsh", "json"}));
  verb.callback([kind, &app, &program] {
    program.run = [kind, &app]() -> Status {
      if (*kind == "json") {
        PrintJson(ToJson(DeclaredVerbs(app)));
        return {};
      }
      std::cout << (*kind == "man" ? ManPage(app) : *kind == "bash" ? BashCompletion(app) : ZshCompletion(app));
      return {};
    };
  });
}

}  // namespace anchorsplat

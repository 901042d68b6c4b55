#include <iostream>
#include <memory>
#include <string>

#include "cli/verb.h"
#include "cli/verb_tree.h"

namespace anchorsplat {

// For the build, which installs what this prints: no verb for people, so --help does not list it.
void AddManual(CLI::App& app, Program& program) {
  CLI::App& verb = *app.add_subcommand("manual", "Print the manual page, or completion for a shell");
  verb.group("");
  const auto kind = std::make_shared<std::string>();
  verb.add_option("kind", *kind, "What to print")->required()->check(CLI::IsMember({"man", "bash", "zsh"}));
  verb.callback([kind, &app, &program] {
    program.run = [kind, &app]() -> Status {
      std::cout << (*kind == "man" ? ManPage(app) : *kind == "bash" ? BashCompletion(app) : ZshCompletion(app));
      return {};
    };
  });
}

}  // namespace anchorsplat

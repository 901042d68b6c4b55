#include <string>
#include <utility>

#include "cli/verb.h"
#include "core/text.h"

namespace anchorsplat {

// The verbs that are Python (docs/python.md): this program only says where they come from. Not listed by --help.
void AddPython(CLI::App& app, Program& program) {
  for (const auto& [name, what] :
       {std::pair("serve", "a service in the browser"), std::pair("batch", "many machines")}) {
    CLI::App& verb = *app.add_subcommand(name, Cat("Of the Python package: ", what));
    verb.group("");
    verb.allow_extras();
    verb.prefix_command();
    verb.callback([verb_name = std::string(name), &program] {
      program.run = [verb_name]() -> Status {
        return Error{ErrorCode::kBadArgument,
                     Cat(verb_name, " is part of the Python package: pip install '.[", verb_name,
                         "]' in the sources, and the anchorsplat that this installs has it (docs/python.md)")};
      };
    });
  }
}

}  // namespace anchorsplat

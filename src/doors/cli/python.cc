#include <string>
#include <utility>

#include "cli/verb.h"
#include "core/text.h"

namespace anchorsplat {

// Stubs of the verbs that the Python package implements (docs/python.md): they say how to install it.
void AddPython(CLI::App& app, Program& program) {
  for (const auto& [name, what] : {std::pair("serve", "HTTP service with a web page"),
                                   std::pair("batch", "Many splats on many cores and machines")}) {
    CLI::App& verb = *app.add_subcommand(name, Cat(what, " (Python package)"));
    verb.footer(Cat("Install it with pip install '.[", name, "]' in the sources, then run anchorsplat ", name,
                    " --help again (docs/python.md)"));
    verb.group("");
    verb.allow_extras();
    verb.prefix_command();
    verb.callback([verb_name = std::string(name), &program] {
      program.run = [verb_name]() -> Status {
        return Error{ErrorCode::kBadArgument,
                     Cat(verb_name, " is part of the Python package: run pip install '.[", verb_name,
                         "]' in the sources and use the anchorsplat it installs (docs/python.md)")};
      };
    });
  }
}

}  // namespace anchorsplat

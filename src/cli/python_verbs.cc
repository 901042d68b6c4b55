#include <string>

#include "cli/verb.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

// Whatever follows is said to the Python package, which has the options.
void AddPythonVerb(CLI::App& app, Program& program, const std::string& name, const std::string& description) {
  CLI::App& verb = AddVerb(app, program, name, description + "; of the Python package", "anchorsplat " + name + " --help");
  verb.allow_extras();
  verb.callback([name, &program] {
    program.run = [name]() -> Status {
      return Error{ErrorCode::kBadArgument, Cat("'", name, "' comes with the Python package: pip install \"anchorsplat[",
                                                name, "]\" gives an 'anchorsplat' that has it")};
    };
  });
}

}  // namespace

void AddPythonVerbs(CLI::App& app, Program& program) {
  AddPythonVerb(app, program, "serve", "Serve a page and an API over HTTP");
  AddPythonVerb(app, program, "batch", "Enhance many splats on many machines");
}

}  // namespace anchorsplat

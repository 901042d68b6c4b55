#include "request/words.h"

#include <algorithm>

#include "request/choice.h"

namespace anchorsplat {

std::vector<std::string> GivenOptions(const CLI::App& verb) {
  std::vector<std::string> given;
  for (const CLI::Option* option : verb.get_options()) {
    if (option->count() > 0) given.push_back(option->get_single_name());
  }
  return given;
}

Status ParseWords(CLI::App& verb, std::vector<std::string> words) {
  CheckNumbers(verb);
  std::ranges::reverse(words);  // as CLI11 takes them
  try {
    verb.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return Error{ErrorCode::kBadArgument, error.what()};
  }
  return {};
}

}  // namespace anchorsplat

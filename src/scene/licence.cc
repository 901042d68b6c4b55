#include "scene/licence.h"

#include <array>
#include <cstddef>

namespace anchorsplat {

namespace {

// Small letters, with every run of blanks and dashes as one blank, so that "CC-BY" and "CC BY" are the same words.
std::string Normalised(std::string_view text) {
  // A licence is named at the beginning; nobody's book is read to the end.
  constexpr size_t kLongest = 1 << 18;
  std::string out;
  for (const char c : text.substr(0, kLongest)) {
    if (c == ' ' || c == '-' || c == '\t' || c == '\r' || c == '\n') {
      if (!out.empty() && out.back() != ' ') out += ' ';
    } else {
      out += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    }
  }
  return out;
}

bool IsWordCharacter(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '#'; }

// Where `words` stand as whole words from `from` on.
size_t FindWords(std::string_view text, std::string_view words, size_t from = 0) {
  for (size_t at = text.find(words, from); at != std::string_view::npos; at = text.find(words, at + 1)) {
    const size_t end = at + words.size();
    if ((at == 0 || !IsWordCharacter(text[at - 1])) && (end == text.size() || !IsWordCharacter(text[end]))) return at;
  }
  return std::string_view::npos;
}

bool Eat(std::string_view& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  return true;
}

// "3.0" at the beginning of `text`, eaten; "" when there is none.
std::string EatVersion(std::string_view& text) {
  if (text.size() < 3 || text[0] < '1' || text[0] > '9' || text[1] != '.' || text[2] < '0' || text[2] > '9') return {};
  std::string version(text.substr(0, 3));
  text.remove_prefix(3);
  return version;
}

// What follows "creativecommons.org/licenses/by".
std::string FromAddress(std::string_view rest) {
  std::string id = "CC-BY";
  if (Eat(rest, " nc")) id += "-NC";
  if (Eat(rest, " nd")) id += "-ND";
  if (Eat(rest, " sa")) id += "-SA";
  if (!Eat(rest, "/")) return {};
  const std::string version = EatVersion(rest);
  if (version.empty()) return {};
  return id + "-" + version + (rest.starts_with("/us") ? "-US" : "");
}

// What follows "creative commons attribution".
std::string FromName(std::string_view rest) {
  std::string id = "CC-BY";
  if (Eat(rest, " noncommercial") || Eat(rest, " non commercial")) id += "-NC";
  if (Eat(rest, " noderivs") || Eat(rest, " noderivatives") || Eat(rest, " no derivs")) id += "-ND";
  if (Eat(rest, " sharealike") || Eat(rest, " share alike")) id += "-SA";
  if (!Eat(rest, " ")) return {};
  const std::string version = EatVersion(rest);
  if (version.empty()) return {};
  return id + "-" + version + (rest.starts_with(" united states") ? "-US" : "");
}

}  // namespace

std::string SpdxIdentifier(std::string_view text) {
  const std::string normal = Normalised(text);
  size_t first = std::string::npos;
  std::string id;
  const auto found = [&](size_t at, const std::string& what) {
    if (at < first && !what.empty()) {
      first = at;
      id = what;
    }
  };
  for (const std::string_view words : std::array<std::string_view, 4>{"creativecommons.org/publicdomain/zero/1.0",
                                                                      "creative commons zero", "cc0", "cc 0"}) {
    found(FindWords(normal, words), "CC0-1.0");
  }
  const auto search = [&](std::string_view prefix, std::string (*read)(std::string_view)) {
    for (size_t at = normal.find(prefix); at < first; at = normal.find(prefix, at + 1)) {
      found(at, read(std::string_view(normal).substr(at + prefix.size())));
    }
  };
  search("creativecommons.org/licenses/by", FromAddress);
  search("creative commons attribution", FromName);
  return id;
}

bool MentionsAttribution(std::string_view text) { return FindWords(Normalised(text), "cc by") != std::string::npos; }

}  // namespace anchorsplat

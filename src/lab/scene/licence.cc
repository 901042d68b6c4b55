#include "scene/licence.h"

#include <array>
#include <cstddef>

namespace anchorsplat {

namespace {

// Lower case, with runs of blanks and dashes as single blanks, so that "CC-BY" equals "CC BY".
std::string Normalised(std::string_view text) {
  // Licences are named at the beginning; long documents are not searched to the end.
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

// Position of `words` as whole words, starting at `from`.
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

// Consumes a version such as "3.0" at the start of `text`; "" if there is none.
std::string EatVersion(std::string_view& text) {
  if (text.size() < 3 || text[0] < '1' || text[0] > '9' || text[1] != '.' || text[2] < '0' || text[2] > '9') return {};
  std::string version(text.substr(0, 3));
  text.remove_prefix(3);
  return version;
}

// Parses what follows "creativecommons.org/licenses/by".
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

// Parses what follows "creative commons attribution".
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

// Parses what follows "cc by".
std::string FromShortName(std::string_view rest) {
  std::string id = "CC-BY";
  if (Eat(rest, " nc")) id += "-NC";
  if (Eat(rest, " nd")) id += "-ND";
  if (Eat(rest, " sa")) id += "-SA";
  if (!Eat(rest, " ")) return {};
  const std::string version = EatVersion(rest);
  return version.empty() ? std::string() : id + "-" + version;
}

// Parses what follows "gnu general public license" or "gpl": a nearby version, and whether later ones are allowed.
std::string FromGnu(std::string_view rest, std::string_view family) {
  // "… as published by the Free Software Foundation; either version 2 of the License, or (at your option) any later".
  constexpr size_t kReach = 160;
  std::string_view beside = rest;
  (void)Eat(beside, " ");
  (void)Eat(beside, "v");
  if (!beside.empty() && beside[0] >= '1' && beside[0] <= '3') {
    rest = beside;
  } else if (const size_t word = rest.substr(0, kReach).find("version "); word != std::string_view::npos) {
    rest.remove_prefix(word + 8);
  }
  if (rest.empty() || rest[0] < '1' || rest[0] > '3' || (rest.size() > 1 && rest[1] >= '0' && rest[1] <= '9'))
    return {};
  std::string version{rest[0]};
  rest.remove_prefix(1);
  if (rest.size() >= 2 && rest[0] == '.' && rest[1] >= '0' && rest[1] <= '9') {
    version += rest.substr(0, 2);
    rest.remove_prefix(2);
  } else {
    version += ".0";
  }
  const std::string id = std::string(family) + "-" + version;
  const std::string_view near = rest.substr(0, 80);
  if (rest.starts_with("+") || rest.starts_with(" or later") || rest.starts_with(" or newer") ||
      near.find("any later version") != std::string_view::npos) {
    return id + "-or-later";
  }
  return id + (rest.starts_with(" only") || rest.starts_with(" of the license") ? "-only" : "");
}

std::string FromGpl(std::string_view rest) { return FromGnu(rest, "GPL"); }
std::string FromLgpl(std::string_view rest) { return FromGnu(rest, "LGPL"); }
std::string FromAgpl(std::string_view rest) { return FromGnu(rest, "AGPL"); }

// Parses what follows "apache license".
std::string FromApache(std::string_view rest) {
  return rest.substr(0, 20).find("2.0") != std::string_view::npos ? "Apache-2.0" : "";
}

// Parses what follows the first words of BSD licences.
std::string FromBsd(std::string_view rest) {
  return rest.substr(0, 2000).find("neither the name") != std::string_view::npos ? "BSD-3-Clause" : "BSD-2-Clause";
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
  for (const std::string_view words : std::array<std::string_view, 4>{
           "mit license", "license: mit", "license: expat",
           "permission is hereby granted, free of charge, to any person obtaining a copy of this software"}) {
    found(FindWords(normal, words), "MIT");
  }
  const auto search = [&](std::string_view prefix, std::string (*read)(std::string_view)) {
    for (size_t at = normal.find(prefix); at < first; at = normal.find(prefix, at + 1)) {
      if (at > 0 && IsWordCharacter(normal[at - 1])) continue;  // "lgpl" is not "gpl"
      found(at, read(std::string_view(normal).substr(at + prefix.size())));
    }
  };
  search("creativecommons.org/licenses/by", FromAddress);
  search("creative commons attribution", FromName);
  search("cc by", FromShortName);
  search("gnu general public license", FromGpl);
  search("gpl", FromGpl);
  search("gnu lesser general public license", FromLgpl);
  search("lgpl", FromLgpl);
  search("gnu affero general public license", FromAgpl);
  search("agpl", FromAgpl);
  search("apache license", FromApache);
  search("apache 2.0", [](std::string_view) { return std::string("Apache-2.0"); });
  search("redistribution and use in source and binary forms", FromBsd);
  return id;
}

bool MentionsAttribution(std::string_view text) { return FindWords(Normalised(text), "cc by") != std::string::npos; }

}  // namespace anchorsplat

#include "dataset/object_name.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

#include "core/fingerprint.h"
#include "core/text.h"
#include "scene/mesh_reader.h"

namespace anchorsplat {

namespace {

bool IsLetterOrDigit(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }
char Lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// Names used by a data set's folder and its .building. Case-insensitive, as some file systems are.
bool IsReserved(const std::string& name) {
  std::string small;
  for (const char c : name) small += Lower(c);
  constexpr std::array<std::string_view, 5> kNames = {"manifest.jsonl", "failures.jsonl", "splits.json", "lock",
                                                      "unfinished"};
  constexpr std::array<std::string_view, 4> kEndings = {".job", ".log", ".lock", ".replaced"};
  return std::find(kNames.begin(), kNames.end(), small) != kNames.end() ||
         std::any_of(kEndings.begin(), kEndings.end(),
                     [&](std::string_view ending) { return small.ends_with(ending); });
}

constexpr std::array<std::string_view, 38> kVariantWords = {
    "red",    "green",  "blue",   "yellow", "orange", "purple", "pink",  "brown",   "black", "white",
    "grey",   "gray",   "beige",  "gold",   "silver", "dark",   "light", "left",    "right", "small",
    "medium", "large",  "big",    "tall",   "short",  "long",   "wide",  "low",     "high",  "single",
    "double", "opened", "closed", "open",   "on",     "off",    "new",   "textured"};

// Last word of a name with separators or in camel case; empty if there is only one.
std::string_view LastWord(std::string_view name) {
  for (size_t i = name.size(); i-- > 1;) {
    const bool separated = !IsLetterOrDigit(name[i - 1]);
    const bool camel = name[i] >= 'A' && name[i] <= 'Z' && name[i - 1] >= 'a' && name[i - 1] <= 'z';
    if (separated || camel) return name.substr(i);
  }
  return {};
}

}  // namespace

std::string SafeName(const std::string& text) {
  std::string out;
  for (const char c : text) out += IsLetterOrDigit(c) || c == '.' || c == '_' || c == '-' ? c : '_';
  while (!out.empty() && out.front() == '.') out.erase(0, 1);  // hidden files, "." and ".."
  return IsReserved(out) ? out + "-object" : out;
}

uint64_t StableHash(std::string_view text, uint64_t seed) {
  Fingerprint fingerprint(seed * 0x9E3779B97F4A7C15u);
  fingerprint.Add(text);
  uint64_t hash = fingerprint.value();
  // FNV's high bits depend little on the last characters: finalise like splitmix64.
  hash = (hash ^ (hash >> 30)) * 0xBF58476D1CE4E5B9u;
  hash = (hash ^ (hash >> 27)) * 0x94D049BB133111EBu;
  return hash ^ (hash >> 31);
}

std::string ObjectName(const std::string& mesh_address) {
  const size_t mark = mesh_address.rfind(".sh3f#");
  std::string name = SafeName(MeshShortName(mesh_address));
  if (mark != std::string::npos) {
    const std::string library = std::filesystem::path(mesh_address.substr(0, mark)).filename().string();
    name = SafeName(library) + "-" + name;
  }
  return name.empty() ? Cat("object-", StableHash(mesh_address) % 1000000) : name;
}

std::string VariantStem(std::string_view name) {
  for (bool again = true; again && !name.empty();) {
    again = false;
    while (name.size() > 1 && (!IsLetterOrDigit(name.back()) || (name.back() >= '0' && name.back() <= '9'))) {
      name.remove_suffix(1);
    }
    std::string word;
    for (const char c : LastWord(name)) word += Lower(c);
    if (!word.empty() && std::find(kVariantWords.begin(), kVariantWords.end(), word) != kVariantWords.end()) {
      name.remove_suffix(word.size());
      again = true;
    }
  }
  std::string stem;
  for (const char c : name) {
    if (IsLetterOrDigit(c)) stem += Lower(c);
  }
  return stem;
}

std::string MeshFingerprint(const Mesh& mesh) {
  std::array<float, 3> low = {1, 1, 1}, high = {-1, -1, -1};
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    double e[3], f[3];
    for (size_t k = 0; k < 3; ++k) {
      for (const uint32_t v : {a, b, c}) {
        low[k] = std::min(low[k], mesh.positions[v][k]);
        high[k] = std::max(high[k], mesh.positions[v][k]);
      }
      e[k] = double{mesh.positions[b][k]} - mesh.positions[a][k];
      f[k] = double{mesh.positions[c][k]} - mesh.positions[a][k];
    }
    area += 0.5 * std::hypot(e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]);
  }
  std::array<float, 3> sides = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
  std::sort(sides.begin(), sides.end());
  const auto percent = [](double x) { return std::lround(100 * x); };
  return Cat("t", mesh.triangles.size(), "-s", percent(sides[0]), ".", percent(sides[1]), "-a", percent(area));
}

}  // namespace anchorsplat

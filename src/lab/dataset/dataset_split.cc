#include "dataset/dataset_split.h"

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/file_system.h"
#include "core/text.h"
#include "dataset/object_name.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"
#include "io/json_file.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr const char* kSplitNames[] = {"train", "validation", "test"};

bool IsSplitName(const std::string& name) {
  return std::find(std::begin(kSplitNames), std::end(kSplitNames), name) != std::end(kSplitNames);
}

// Whether `source` ends with the whole address: "a/b/c.obj" matches "b/c.obj" but not "bb/c.obj".
bool EndsWithAddress(const std::string& source, const std::string& address) {
  if (!source.ends_with(address)) return false;
  return source.size() == address.size() || address.starts_with("/") ||
         source[source.size() - address.size() - 1] == '/';
}

}  // namespace

std::vector<std::vector<std::string>> VariantGroups(const Manifest& manifest, bool by_name) {
  // Union-find over objects, stems and fingerprints; those of one object are joined.
  std::map<std::string, std::string> parent;
  const std::function<std::string(const std::string&)> root = [&](const std::string& node) {
    std::string at = node;
    while (parent.at(at) != at) at = parent.at(at) = parent.at(parent.at(at));
    return at;
  };
  for (const auto& [name, record] : manifest) {
    const std::string self = "object " + name;
    std::vector<std::string> nodes = {self, "source " + record.source, "shape " + record.fingerprint};
    if (by_name) nodes.push_back("stem " + record.stem);
    for (const std::string& node : nodes) {
      parent.emplace(node, node);
      parent[root(node)] = root(self);
    }
  }
  std::map<std::string, std::vector<std::string>> groups;
  for (const auto& [name, record] : manifest) groups[root("object " + name)].push_back(name);
  std::vector<std::vector<std::string>> out;
  for (auto& [key, names] : groups) out.push_back(std::move(names));
  std::sort(out.begin(), out.end());
  return out;
}

Result<Splits> SplitByModel(const Manifest& manifest, const SplitFractions& fractions, uint64_t seed) {
  if (!(fractions.validation >= 0 && fractions.test >= 0 && fractions.validation + fractions.test <= 1)) {
    return Error{ErrorCode::kBadArgument, Cat("fractions ", fractions.validation, " for validation and ",
                                              fractions.test, " for test add up to more than 1 or are negative")};
  }
  Splits splits;
  for (const auto& group : VariantGroups(manifest, true)) {
    // The smallest stem, not the first name: a later variant may sort before it.
    std::string stem = manifest.at(group[0]).stem;
    for (const std::string& name : group) stem = std::min(stem, manifest.at(name).stem);
    const double u = static_cast<double>(StableHash(stem, seed) >> 11) * 0x1.0p-53;
    const int split = u < fractions.test ? 2 : u < fractions.test + fractions.validation ? 1 : 0;
    for (const std::string& name : group) splits[name] = kSplitNames[split];
  }
  return splits;
}

Result<Splits> SplitByLists(const Manifest& manifest, const std::map<std::string, std::vector<std::string>>& lists) {
  Splits splits;
  for (const auto& [name, record] : manifest) {
    for (const auto& [split, addresses] : lists) {
      const bool listed = std::any_of(addresses.begin(), addresses.end(), [&, &source = record.source](const auto& a) {
        return EndsWithAddress(source, a);
      });
      if (!listed) continue;
      if (const auto [there, fresh] = splits.emplace(name, split); !fresh && there->second != split) {
        return Error{ErrorCode::kBadArgument, Cat(name, " is listed for ", there->second, " and for ", split)};
      }
    }
  }
  for (const auto& group : VariantGroups(manifest, false)) {
    std::string first, split;
    for (const std::string& name : group) {
      const auto found = splits.find(name);
      if (found == splits.end()) continue;
      if (!split.empty() && found->second != split) {
        return Error{ErrorCode::kBadArgument,
                     Cat(first, " and ", name, " are variants of one model, but the lists put one into ", split,
                         " and the other into ", found->second)};
      }
      first = name;
      split = found->second;
    }
  }
  return splits;
}

Result<Splits> ReadSplits(const fs::path& dataset) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile json, JsonFile::Read(dataset / kSplitsName));
  Splits splits;
  for (const char* split : kSplitNames) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue list, json.root().Get(split));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto elements, list.Elements());
    for (const JsonValue& element : elements) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, element.Text());
      if (!splits.emplace(name, split).second) return element.Complain(Cat(Printable(name), " is listed twice"));
    }
  }
  return splits;
}

Status WriteSplits(const fs::path& dataset, const Splits& splits) {
  nlohmann::json json;
  for (const char* split : kSplitNames) json[split] = nlohmann::json::array();
  for (const auto& [name, split] : splits) {
    if (!IsSplitName(split))
      return Error{ErrorCode::kBadArgument, Cat("\"", split, "\" is not a split (train, validation or test)")};
    json[split].push_back(name);
  }
  return WriteWholeFile(dataset / kSplitsName,
                        json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n", true);
}

Result<std::vector<std::string>> ReadAddressList(const fs::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path, uint64_t{64} << 20));
  std::vector<std::string> addresses;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    std::string line = text.substr(at, end - at);
    at = end + 1;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) line.pop_back();
    if (!line.empty() && line.front() != '#') addresses.push_back(std::move(line));
  }
  return addresses;
}

Result<std::vector<std::string>> ResolveAddresses(const std::vector<std::string>& addresses, const fs::path& objects) {
  std::map<std::string, std::vector<fs::path>> libraries;  // by file name, searched once
  bool looked = false;
  std::vector<std::string> out;
  for (const std::string& address : addresses) {
    const size_t mark = address.rfind(".sh3f#");
    const fs::path file = mark == std::string::npos ? address : address.substr(0, mark + 5);
    const std::string object = mark == std::string::npos ? "" : address.substr(mark + 5);
    std::error_code code;
    if (IsFile(objects / file)) {
      out.push_back((objects / file).string() + object);
      continue;
    }
    for (fs::recursive_directory_iterator it(objects, code), end; !looked && !code && it != end; it.increment(code)) {
      if (it->path().extension() == ".sh3f") libraries[it->path().filename().string()].push_back(it->path());
    }
    looked = true;
    auto& found = libraries[file.string()];
    if (found.empty()) {
      return Error{ErrorCode::kNotFound,
                   Cat(address, ": not found below ", objects.string(), " (fetch it with scripts/fetch-objects.sh)")};
    }
    std::sort(found.begin(), found.end());
    if (found.size() > 1) {
      return Error{ErrorCode::kBadArgument,
                   Cat(address, ": matches both ", found[0].string(), " and ", found[1].string())};
    }
    out.push_back(found[0].string() + object);
  }
  return out;
}

}  // namespace anchorsplat

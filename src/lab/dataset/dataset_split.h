#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_record.h"

namespace anchorsplat {

// Split of each object by name: "train", "validation" or "test".
using Splits = std::map<std::string, std::string>;
inline constexpr const char* kSplitsName = "splits.json";

// Groups of objects that must stay in one split: fits of one mesh, meshes with equal fingerprint and, with `by_name`,
// those whose names in a library have the same stem (object_name.h), which joins rather too many than too few. Names
// and groups are sorted.
std::vector<std::vector<std::string>> VariantGroups(const Manifest& manifest, bool by_name);

struct SplitFractions {
  double validation = 0.1;
  double test = 0.1;
};

// Assigns groups to splits by a hash of their stem (the first one if fingerprints join several) and the seed. Adding
// objects moves no others, unless a copy with a smaller stem joins their group. Fractions hold on average.
// kBadArgument:
// fractions not in 0–1, or together above 1.
Result<Splits> SplitByModel(const Manifest& manifest, const SplitFractions& fractions, uint64_t seed);

// Assigns objects made from an address in `lists[split]`; objects in no list get no split. Addresses match by their
// end:
// "catalog.sh3f#chair" matches "/usr/share/…/catalog.sh3f#chair". kBadArgument: an object in two lists; objects of one
// mesh or fingerprint in different lists (names do not matter here).
Result<Splits> SplitByLists(const Manifest& manifest, const std::map<std::string, std::vector<std::string>>& lists);

Result<Splits> ReadSplits(const std::filesystem::path& dataset);
Status WriteSplits(const std::filesystem::path& dataset, const Splits& splits);  // replaces an existing file

// Reads a text file with one address per line, skipping empty lines and those starting with #. Errors: as
// ReadFileBytes.
Result<std::vector<std::string>> ReadAddressList(const std::filesystem::path& path);

// Resolves addresses below `objects`: at exactly that path, or for a furniture library wherever its file name is
// unique.
// kNotFound; kBadArgument: several places.
Result<std::vector<std::string>> ResolveAddresses(const std::vector<std::string>& addresses,
                                                  const std::filesystem::path& objects);

}  // namespace anchorsplat

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_record.h"

namespace anchorsplat {

// Which part of a data set each object is for, by object name: "train", "validation" or "test".
using Splits = std::map<std::string, std::string>;
inline constexpr const char* kSplitsName = "splits.json";

// Objects that may not be parted: fits of one mesh, meshes of equal fingerprint and, with `by_name`, those whose names
// in one library have the same stem (object_name.h), which joins rather too much than too little. Each group's names
// are sorted, and so are the groups.
std::vector<std::vector<std::string>> VariantGroups(const Manifest& manifest, bool by_name);

struct SplitFractions {
  double validation = 0.1;
  double test = 0.1;
};

// Splits by hash of each group's stem (the first of them where equal fingerprints join several) and the seed: adding
// objects moves none of the others, unless a copy under a smaller stem joins their group. Fractions are met on average.
// kBadArgument: fractions out of 0–1 or above 1 together.
Result<Splits> SplitByModel(const Manifest& manifest, const SplitFractions& fractions, uint64_t seed);

// Splits as lists of mesh addresses say: objects made from an address in `lists[split]`. Addresses are compared by
// their end, "catalog.sh3f#chair" with "/usr/share/…/catalog.sh3f#chair". kBadArgument: an object in two lists, two
// objects of one mesh or of one fingerprint parted by them; names say nothing here. Objects in no list are in no split.
Result<Splits> SplitByLists(const Manifest& manifest, const std::map<std::string, std::vector<std::string>>& lists);

Result<Splits> ReadSplits(const std::filesystem::path& dataset);
Status WriteSplits(const std::filesystem::path& dataset, const Splits& splits);  // replaces older ones

// A text file of addresses, one a line; empty lines and those that begin with # are left out. Errors: as ReadFileBytes.
Result<std::vector<std::string>> ReadAddressList(const std::filesystem::path& path);

// Where the meshes of such a list are below `objects`: each at that very place, or, of a furniture library, at the only
// place where a file of its name is. kNotFound; kBadArgument: several places.
Result<std::vector<std::string>> ResolveAddresses(const std::vector<std::string>& addresses,
                                                  const std::filesystem::path& objects);

}  // namespace anchorsplat

#include "model/network_file.h"

#include <utility>

#include "formats/tensor_file.h"
#include "model/checkpoint.h"

namespace anchorsplat {

Result<bool> HoldsCompactNetwork(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
  return IsCompactNetwork(file);
}

Result<AnyNetwork> LoadAnyNetwork(const std::filesystem::path& path, WeightPrecision precision) {
  {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
    if (IsCompactNetwork(file)) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(CompactNetwork network, LoadCompactNetwork(file));
      return AnyNetwork(std::move(network));
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(PackedNetwork network, LoadNetwork(path, precision));
  return AnyNetwork(std::move(network));
}

}  // namespace anchorsplat

#include "model/any_network.h"

#include <utility>

#include "published/published_checkpoint.h"
#include "tensors/tensor_file.h"

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
  ANCHORSPLAT_ASSIGN_OR_RETURN(PublishedNetwork network, LoadPublishedNetwork(path, precision));
  return AnyNetwork(std::move(network));
}

}  // namespace anchorsplat

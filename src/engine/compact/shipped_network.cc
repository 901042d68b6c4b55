#include "compact/shipped_network.h"

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/fingerprint.h"
#include "core/include_bytes.h"
#include "core/text.h"
#include "tensors/tensor_file.h"

#ifdef ANCHORSPLAT_SHIPPED_NETWORKS
ANCHORSPLAT_INCLUDE_BYTES("anchorsplat_shipped_classic",
                          ANCHORSPLAT_SHIPPED_NETWORKS "/anchorsplat-compact.safetensors");
ANCHORSPLAT_INCLUDE_BYTES("anchorsplat_shipped_single", ANCHORSPLAT_SHIPPED_NETWORKS "/anchorsplat-single.safetensors");
ANCHORSPLAT_INCLUDE_BYTES("anchorsplat_shipped_antialiased",
                          ANCHORSPLAT_SHIPPED_NETWORKS "/anchorsplat-antialiased.safetensors");
extern "C" {
extern const std::byte anchorsplat_shipped_classic[];
extern const std::byte anchorsplat_shipped_classic_end[];
extern const std::byte anchorsplat_shipped_single[];
extern const std::byte anchorsplat_shipped_single_end[];
extern const std::byte anchorsplat_shipped_antialiased[];
extern const std::byte anchorsplat_shipped_antialiased_end[];
}
#endif

namespace anchorsplat {

namespace {

std::span<const std::byte> ShippedBytes([[maybe_unused]] Shipped which) {
#ifdef ANCHORSPLAT_SHIPPED_NETWORKS
  switch (which) {
    case Shipped::kClassic:
      return {anchorsplat_shipped_classic, anchorsplat_shipped_classic_end};
    case Shipped::kSingle:
      return {anchorsplat_shipped_single, anchorsplat_shipped_single_end};
    case Shipped::kAntialiased:
      return {anchorsplat_shipped_antialiased, anchorsplat_shipped_antialiased_end};
  }
  return {};
#else
  return {};
#endif
}

}  // namespace

bool HasShippedNetwork() { return !ShippedBytes(Shipped::kClassic).empty(); }

std::string ShippedNetworkIdentity() {
  if (!HasShippedNetwork()) return "";
  Fingerprint print;
  std::string identity;
  for (const Shipped which : kAllShipped) {
    print.Add(ShippedBytes(which));
    identity += Cat(ShippedBytes(which).size(), " ");
  }
  return Cat(identity, print.value());
}

Result<CompactNetwork> LoadShippedNetwork(Shipped which) {
  const std::span<const std::byte> bytes = ShippedBytes(which);
  if (bytes.empty()) return Error{ErrorCode::kNotFound, "this program was built without weights of its own"};
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const TensorFile file,
      TensorFile::FromBytes(Buffer<std::byte>(bytes.begin(), bytes.end()), "the built-in network"));
  return LoadCompactNetwork(file);
}

}  // namespace anchorsplat

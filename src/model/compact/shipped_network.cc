#include "model/compact/shipped_network.h"

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/fingerprint.h"
#include "core/text.h"
#include "tensors/tensor_file.h"

#ifdef ANCHORSPLAT_SHIPPED_NETWORK
// The assembler copies the file into the constants of the program: both compilers know this, C++20 has nothing for it.
asm(".section .rodata\n"
    ".balign 64\n"
    ".hidden anchorsplat_shipped_network\n"
    ".hidden anchorsplat_shipped_network_end\n"
    ".globl anchorsplat_shipped_network\n"
    ".globl anchorsplat_shipped_network_end\n"
    "anchorsplat_shipped_network:\n"
    ".incbin \"" ANCHORSPLAT_SHIPPED_NETWORK
    "\"\n"
    "anchorsplat_shipped_network_end:\n"
    ".byte 0\n"
    ".text\n");
extern "C" {
extern const std::byte anchorsplat_shipped_network[];
extern const std::byte anchorsplat_shipped_network_end[];
}
#endif

namespace anchorsplat {

namespace {

std::span<const std::byte> ShippedBytes() {
#ifdef ANCHORSPLAT_SHIPPED_NETWORK
  return {anchorsplat_shipped_network, anchorsplat_shipped_network_end};
#else
  return {};
#endif
}

}  // namespace

bool HasShippedNetwork() { return !ShippedBytes().empty(); }

std::string ShippedNetworkIdentity() {
  if (!HasShippedNetwork()) return "";
  Fingerprint print;
  print.Add(ShippedBytes());
  return Cat(ShippedBytes().size(), " ", print.value());
}

Result<CompactNetwork> LoadShippedNetwork() {
  if (!HasShippedNetwork()) return Error{ErrorCode::kNotFound, "this program was built without weights of its own"};
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const TensorFile file,
      TensorFile::FromBytes(Buffer<std::byte>(ShippedBytes().begin(), ShippedBytes().end()), "the built-in network"));
  return LoadCompactNetwork(file);
}

}  // namespace anchorsplat

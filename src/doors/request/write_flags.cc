#include "request/write_flags.h"

#include "request/choice.h"

namespace anchorsplat {

CLI::Option* AddWriteFlags(CLI::App& verb, CloudWriteOptions& write) {
  AddChoice(verb, "--sort", write.order,
            {{"format", SplatOrder::kFormat},
             {"keep", SplatOrder::kKeep},
             {"morton", SplatOrder::kMorton},
             {"importance", SplatOrder::kImportance}},
            "Order of the Gaussians in the file");
  auto* spz_version = verb.add_option("--spz-version", write.spz_version, "4, or 3 for programs that only read gzip");
  spz_version->check(CLI::IsMember({3, 4}))->capture_default_str();
  return spz_version;
}

}  // namespace anchorsplat

#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "enhance/enhance.h"

namespace anchorsplat {

// A network that "auto" chooses before all others, for options with this seed only: methods stay registered for the
// tests that follow.
inline void RegisterNetworkForTest(
    const std::string& name, uint64_t only_with_seed,
    std::function<GaussianCloud(EnhanceInput, const EnhanceOptions&)> run =
        [](EnhanceInput input, const EnhanceOptions&) { return std::move(input.cloud); }) {
  RegisterEnhanceMethod(
      {.name = name,
       .summary = "of a test",
       .rank = 100,
       .adds_detail = true,
       .options = WidthOptions(),
       .ready =
           [only_with_seed](const EnhanceOptions& o) {
             return o.seed == only_with_seed ? Status() : Status(Error{ErrorCode::kBadArgument, "not here"});
           },
       .run = [run = std::move(run)](EnhanceInput input, const EnhanceOptions& o,
                                     StepReport&) -> Result<GaussianCloud> { return run(std::move(input), o); }});
}

}  // namespace anchorsplat

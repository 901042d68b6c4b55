#pragma once

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cstdint>
#include <string>
#include <vector>

namespace anchorsplat {

// Those that were compiled and that this machine supports, the best one first.
inline std::vector<int64_t> SimdTargetsHere() { return hwy::SupportedAndGeneratedTargets(); }

// Calls body() once per SIMD target, the best one last, so that the narrow ones are tested too.
template <typename Body>
void ForEachSimdTarget(Body&& body) {
  const auto targets = SimdTargetsHere();
  for (auto target = targets.rbegin(); target != targets.rend(); ++target) {
    hwy::SetSupportedTargetsForTest(*target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    SCOPED_TRACE(std::string("SIMD target ") + hwy::TargetName(*target));
    body();
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

// At the end of a test which says that every instruction set was looked at: where there is only one it is skipped, not
// passed, and CTest lists it so. What that one computes was compared all the same, and a failure stays a failure.
inline void SkipWhenOnlyOneSimdTarget(const std::vector<int64_t>& targets = SimdTargetsHere()) {
  if (targets.size() > 1) return;
  GTEST_SKIP() << "this machine runs only one of the compiled instruction sets, "
               << (targets.empty() ? "none" : hwy::TargetName(targets.front())) << ": no other was compared";
}

}  // namespace anchorsplat

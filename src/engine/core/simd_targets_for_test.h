#pragma once

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cstdint>
#include <string>
#include <vector>

namespace anchorsplat {

// SIMD targets that were compiled and that this machine supports, best first.
inline std::vector<int64_t> SimdTargetsHere() { return hwy::SupportedAndGeneratedTargets(); }

// Calls body() once per SIMD target, best last, to test the narrow ones too.
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

// For the end of a test that compares all instruction sets: on a machine with only one, the test is reported as
// skipped, not passed. Its own results were checked all the same, and a failure stays a failure.
inline void SkipWhenOnlyOneSimdTarget(const std::vector<int64_t>& targets = SimdTargetsHere()) {
  if (targets.size() > 1) return;
  GTEST_SKIP() << "this machine runs only one of the compiled instruction sets, "
               << (targets.empty() ? "none" : hwy::TargetName(targets.front())) << ": no other was compared";
}

}  // namespace anchorsplat

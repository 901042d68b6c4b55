#pragma once

namespace anchorsplat {

// Floating-point operations per second of nothing but fused multiply-adds on registers, in fp32 on all threads that
// ParallelFor uses, over about `seconds`. What no kernel can exceed.
double MeasurePeakFlops(double seconds);

}  // namespace anchorsplat

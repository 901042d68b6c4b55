#pragma once

namespace anchorsplat {

// Peak fp32 FLOP/s: fused multiply-adds on registers on all ParallelFor threads for about `seconds`. The upper bound of
// every kernel.
double MeasurePeakFlops(double seconds);

}  // namespace anchorsplat

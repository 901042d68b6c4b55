#pragma once

// Put before a loop of constant count. Arrays of vectors it indexes go to registers only if fully unrolled.
#if defined(__clang__)
#define ANCHORSPLAT_UNROLL _Pragma("clang loop unroll(full)")
#elif defined(__GNUC__)
#define ANCHORSPLAT_UNROLL _Pragma("GCC unroll 64")
#else
#define ANCHORSPLAT_UNROLL
#endif

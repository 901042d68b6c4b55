#pragma once

// Before a loop whose count is a constant: the arrays of vectors it walks must end up in registers, and they only do
// when no index is left.
#if defined(__clang__)
#define ANCHORSPLAT_UNROLL _Pragma("clang loop unroll(full)")
#elif defined(__GNUC__)
#define ANCHORSPLAT_UNROLL _Pragma("GCC unroll 64")
#else
#define ANCHORSPLAT_UNROLL
#endif

// Functions on SIMD vectors of floats, compiled once per SIMD target (hence the unusual include guard).
#if defined(ANCHORSPLAT_MODEL_VECTOR_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef ANCHORSPLAT_MODEL_VECTOR_MATH_INL_H_
#undef ANCHORSPLAT_MODEL_VECTOR_MATH_INL_H_
#else
#define ANCHORSPLAT_MODEL_VECTOR_MATH_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "kernels/rounding.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// 2^f for |f| ≤ 1/2, relative error 8e-8: minimax polynomial of degree 5 (Remez, relative weight).
template <class D, class V = hn::VFromD<D>>
HWY_INLINE V Exp2Fraction(D d, V f) {
  V p = hn::Set(d, 0.00132764719794792f);
  p = hn::MulAdd(p, f, hn::Set(d, 0.009675541334216064f));
  p = hn::MulAdd(p, f, hn::Set(d, 0.05550713273542585f));
  p = hn::MulAdd(p, f, hn::Set(d, 0.24022119723848476f));
  p = hn::MulAdd(p, f, hn::Set(d, 0.6931469670647331f));
  return hn::MulAdd(p, f, hn::Set(d, 1.0000000716546822f));
}

// Adding 1.5·2^23 rounds to the nearest integer and leaves it in the sum's low bits.
inline constexpr float kToInteger = 12582912.0f;

// 2^x for |x| ≤ 125, without range checks; the result for NaN is undefined.
template <class D, class V = hn::VFromD<D>>
HWY_INLINE V Exp2Bounded(D d, V x) {
  const hn::RebindToSigned<D> di;
  const V shifted = hn::Add(x, hn::Set(d, kToInteger));
  const V f = hn::Sub(x, hn::Sub(shifted, hn::Set(d, kToInteger)));
  const auto exponent = hn::ShiftLeft<23>(hn::BitCast(di, shifted));  // the bits of 1.5·2^23 are shifted out
  return hn::BitCast(d, hn::Add(hn::BitCast(di, Exp2Fraction(d, f)), exponent));
}

// 2^x for x ≤ 125; 0 below −126 (no subnormals); NaN stays NaN.
template <class D, class V = hn::VFromD<D>>
HWY_INLINE V Exp2(D d, V x) {
  const hn::RebindToSigned<D> di;
  const V lowest = hn::Set(d, -126.0f);
  const auto vanishes = hn::Lt(x, lowest);
  const V z = hn::IfThenElse(vanishes, lowest, x);
  const V shifted = hn::Add(z, hn::Set(d, kToInteger));
  const V f = hn::Sub(z, hn::Sub(shifted, hn::Set(d, kToInteger)));
  const auto exponent = hn::ShiftLeft<23>(hn::Add(hn::BitCast(di, shifted), hn::Set(di, 127)));
  return hn::IfThenZeroElse(vanishes, hn::Mul(Exp2Fraction(d, f), hn::BitCast(d, exponent)));
}

// erf(x), relative error 4e-7: x·N(x²)/D(x²) below 4 (rational minimax of degrees 5 and 5 in x²), ±1 beyond.
template <class D, class V = hn::VFromD<D>>
HWY_INLINE V Erf(D d, V x) {
  const V s = hn::Mul(x, x);
  V n = hn::Set(d, 1.9867549968303307e-06f);
  n = hn::MulAdd(n, s, hn::Set(d, 0.0002845625968172118f));
  n = hn::MulAdd(n, s, hn::Set(d, 0.0038833096859909617f));
  n = hn::MulAdd(n, s, hn::Set(d, 0.053101639367522185f));
  n = hn::MulAdd(n, s, hn::Set(d, 0.19354464504049074f));
  n = hn::MulAdd(n, s, hn::Set(d, 1.1283791393512301f));
  V q = hn::Set(d, 3.74197119499413e-05f);
  q = hn::MulAdd(q, s, hn::Set(d, 0.0011855578796919634f));
  q = hn::MulAdd(q, s, hn::Set(d, 0.015207187189294372f));
  q = hn::MulAdd(q, s, hn::Set(d, 0.11534978099883716f));
  q = hn::MulAdd(q, s, hn::Set(d, 0.5048570317722781f));
  q = hn::MulAdd(q, s, hn::Set(d, 1.0f));
  const V inner = hn::Div(hn::Mul(x, n), q);
  return hn::IfThenElse(hn::Ge(s, hn::Set(d, 16.0f)), hn::CopySign(hn::Set(d, 1.0f), x), inner);
}

// x·Φ(x), the exact form of GELU (Hendrycks & Gimpel 2016), not its tanh approximation.
template <class D, class V = hn::VFromD<D>>
HWY_INLINE V Gelu(D d, V x) {
  const V half = hn::Mul(x, hn::Set(d, 0.5f));
  return hn::MulAdd(half, Erf(d, hn::Mul(x, hn::Set(d, 0.70710678118654752f))), half);
}

// Rounds to the nearest fp16 value, ties to even, as a float: infinity from 65520, subnormals kept, NaN stays NaN.
template <class D, class V = hn::VFromD<D>>
HWY_INLINE V RoundToHalf(D d, V x) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL || HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_NEON
  return hn::PromoteTo(d, hn::DemoteTo(hn::Rebind<hwy::float16_t, D>(), x));
#else
  // These targets have no instruction for it, and Highway's emulation truncates.
  const hn::RebindToUnsigned<D> du;
  const V magnitude = hn::Abs(x);
  const auto bits = hn::BitCast(du, magnitude);
  const auto odd = hn::And(hn::ShiftRight<13>(bits), hn::Set(du, 1u));
  const auto rounded = hn::AndNot(hn::Set(du, 0x1fffu), hn::Add(hn::Add(bits, hn::Set(du, 0xfffu)), odd));
  V y = hn::BitCast(d, rounded);
  // Below 2^-14 the grid is 2^-24 wide, which is the spacing of floats from 1/2 to 1.
  const V offset = hn::Set(d, 0.5f);
  y = hn::IfThenElse(hn::Lt(magnitude, hn::Set(d, 6.103515625e-05f)), hn::Sub(hn::Add(magnitude, offset), offset), y);
  y = hn::IfThenElse(hn::Ge(magnitude, hn::Set(d, 65520.0f)), hn::BitCast(d, hn::Set(du, 0x7f800000u)), y);
  return hn::IfThenElse(hn::Eq(x, x), hn::CopySign(y, x), x);
#endif
}

// Rounds to the nearest bfloat16 value, ties to even, as a float; NaN stays NaN.
template <class D, class V = hn::VFromD<D>>
HWY_INLINE V RoundToBFloat16(D d, V x) {
  const hn::RebindToUnsigned<D> du;
  const auto bits = hn::BitCast(du, x);
  const auto odd = hn::And(hn::ShiftRight<16>(bits), hn::Set(du, 1u));
  const auto rounded = hn::AndNot(hn::Set(du, 0xffffu), hn::Add(hn::Add(bits, hn::Set(du, 0x7fffu)), odd));
  return hn::IfThenElse(hn::Eq(x, x), hn::BitCast(d, rounded), x);
}

template <Rounding kRounding, class D, class V = hn::VFromD<D>>
HWY_INLINE V Round(D d, V x) {
  if constexpr (kRounding == Rounding::kHalf) return RoundToHalf(d, x);
  if constexpr (kRounding == Rounding::kBFloat16) return RoundToBFloat16(d, x);
  (void)d;
  return x;
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#endif

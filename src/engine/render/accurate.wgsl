// Arithmetic with the CPU's accuracy on every driver: WGSL allows exp(−5) 13 ulp, fma two roundings, and has no double.
// A "wide" number is the sum of two floats, x + y, about 48 bits. Appended to render/view.wgsl, which defines Opaque.

// x finite and below 88; relative error below 2e-7, 0 where the result is not a normal number (Cephes, expf).
fn Exp(x: f32) -> f32 {
  let n = floor(x * 1.44269504 + 0.5);
  if (n < -126.0) { return 0.0; }
  let f = (x - n * 0.693359375) + n * 2.12194440e-4;
  var p = 1.9875691500e-4;
  p = p * f + 1.3981999507e-3;
  p = p * f + 8.3334519073e-3;
  p = p * f + 4.1665795894e-2;
  p = p * f + 1.6666665459e-1;
  p = p * f + 5.0000001201e-1;
  return (p * f * f + f + 1.0) * bitcast<f32>((i32(n) + 127) << 23u);
}

// x normal and positive.
fn Log2(x: f32) -> f32 {
  let bits = bitcast<u32>(x);
  var e = i32(bits >> 23u) - 127;
  var m = bitcast<f32>((bits & 0x7fffffu) | 0x3f800000u);  // 1 … 2
  if (m > 1.41421356) {
    m *= 0.5;
    e += 1;
  }
  // The inverse hyperbolic tangent's series: log2(m) = 2/ln 2·(s + s³/3 + …), |s| < 0.172.
  let s = (m - 1.0) / (m + 1.0);
  let s2 = s * s;
  var p = 0.32059889;
  p = p * s2 + 0.41219858;
  p = p * s2 + 0.57707802;
  p = p * s2 + 0.96179669;
  return f32(e) + (p * s2 * s + 2.88539008 * s);
}

// a + b, exactly (Knuth).
fn TwoSum(a: f32, b: f32) -> vec2f {
  let s = Opaque(a + b);
  let from_b = Opaque(s - a);
  return vec2f(s, Opaque(a - Opaque(s - from_b)) + Opaque(b - from_b));
}

// a·b, exactly while nothing leaves the range of floats (Dekker, Veltkamp).
fn TwoProduct(a: f32, b: f32) -> vec2f {
  let p = Opaque(a * b);
  let ca = Opaque(4097.0 * a);
  let ah = Opaque(ca - Opaque(ca - a));
  let al = Opaque(a - ah);
  let cb = Opaque(4097.0 * b);
  let bh = Opaque(cb - Opaque(cb - b));
  let bl = Opaque(b - bh);
  return vec2f(p, Opaque(Opaque(Opaque(Opaque(ah * bh) - p) + Opaque(ah * bl)) + Opaque(al * bh)) + Opaque(al * bl));
}

fn WideSum(a: vec2f, b: vec2f) -> vec2f {
  let s = TwoSum(a.x, b.x);
  return TwoSum(s.x, s.y + (a.y + b.y));
}

fn WideProduct(a: vec2f, b: vec2f) -> vec2f {
  let p = TwoProduct(a.x, b.x);
  return TwoSum(p.x, p.y + (a.x * b.y + a.y * b.x));
}

fn WideQuotient(a: vec2f, b: vec2f) -> vec2f {
  let q = Opaque(a.x / b.x);
  let p = TwoProduct(q, b.x);
  let rest = (Opaque(a.x - p.x) - p.y) + (a.y - q * b.y);
  return TwoSum(q, rest / b.x);
}

// a·b − c·d.
fn DifferenceOfProducts(a: f32, b: f32, c: f32, d: f32) -> f32 {
  let first = TwoProduct(a, b);
  let second = TwoProduct(c, d);
  return Opaque(first.x - second.x) + (first.y - second.y);
}

// Bits of |x|: they sort like |x|, with infinities and NaN after all numbers. Compilers may assume that floats are
// finite, but not integers.
fn Magnitude(x: f32) -> u32 { return bitcast<u32>(x) & 0x7fffffffu; }
const INFINITE = 0x7f800000u;

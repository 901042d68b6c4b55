'use strict';
// The rasterizer of Kerbl et al. 2023 in the order a GPU likes: Gaussians as quads, farthest first, blended
// premultiplied. Same projection, dilation and cut-offs as anchorsplat's own renderer; the numbers come with the page.

const QUADS_AT_ONCE = 256;
const PROJECTED_AT_ONCE = 1 << 20;  // 32 MB of the graphics card

// Spherical harmonics up to `degree`, as 3DGS orders and signs them. GLSL that adds them to `color` for the direction (x, y, z).
function harmonicsSource(degree) {
  const terms = [
    '-0.48860251190291992 * y', '0.48860251190291992 * z', '-0.48860251190291992 * x',
    '1.0925484305920792 * x * y', '-1.0925484305920792 * y * z', '0.94617469575755997 * z2 - 0.31539156525251999',
    '-1.0925484305920792 * x * z', '0.54627421529603959 * (x2 - y2)',
    '-0.59004358992664352 * y * (3.0 * x2 - y2)', '2.8906114426405538 * x * y * z',
    'y * (0.45704579946446572 - 2.2852289973223288 * z2)', 'z * (1.865881662950577 * z2 - 1.1195289977703462)',
    'x * (0.45704579946446572 - 2.2852289973223288 * z2)', '1.4453057213202769 * z * (x2 - y2)',
    '-0.59004358992664352 * x * (x2 - 3.0 * y2)',
  ];
  const count = (degree + 1) ** 2 - 1;
  const lines = [];
  const words = Math.ceil(3 * count / 4);
  for (let texel = 0; 4 * texel < words; ++texel) {
    lines.push(`uvec4 w${texel} = texel(uHarmonics, index * ${Math.ceil(words / 4)}u + ${texel}u);`);
    for (let k = 4 * texel; k < Math.min(words, 4 * texel + 4); ++k) {
      lines.push(`vec4 v${k} = companded(w${texel}[${k % 4}]);`);
    }
  }
  const value = (j) => `v${j >> 2}[${j & 3}]`;
  for (let c = 0; c < count; ++c) {
    const band = c < 3 ? 0 : c < 8 ? 1 : 2;
    lines.push(`color += (${terms[c]}) * uHarmonicMax[${band}] * vec3(${[0, 1, 2].map((k) => value(3 * c + k))});`);
  }
  return lines.join('\n  ');
}

// One pixel per Gaussian: what the corners of its quad need to know, worked out once instead of by each of them. Two texels of
// bits: centre and longer half axis in pixels; length of the shorter one, reach in standard deviations (0: not to be
// seen), colour and opacity as halves.
const projectionSource = (degree) => `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;

uniform usampler2D uGeometry;
uniform usampler2D uHarmonics;
uniform usampler2D uOrder;    // farthest first
uniform ivec2 uRange;         // of it: what the first pixel is, end
uniform mat3 uRotation;       // world to camera
uniform vec3 uTranslation;    // camera position of the splat's centre
uniform vec3 uEye;            // camera centre, relative to the splat's centre
uniform vec4 uIntrinsics;     // fx, fy, cx, cy in pixels
uniform vec4 uClip;           // left, top, right, bottom of what is drawn, pixels
uniform vec4 uTangents;       // limits of x/z (min, max) and y/z (min, max) in the Jacobian
uniform vec2 uLogScale;       // min, max
uniform float uWidening;      // variance added to every axis, world units²
uniform vec2 uDc;             // min, max
uniform vec3 uHarmonicMax;    // per degree
uniform float uHarmonicTop;   // largest code of a harmonic
uniform float uScalarTop;     // largest scalar code
uniform float uDilation;      // px²
uniform float uSoftening;     // px², where the target has fewer pixels than the screen: what is seen fades as it grows
uniform float uMinAlpha;
uniform float uNear;
uniform bool uCompensated;    // opacity, for the dilation
uniform vec3 uBoxLow;         // relative to the splat's centre
uniform vec3 uBoxHigh;
uniform float uOutside;       // of the opacity of what is outside of the box

layout(location = 0) out uvec4 placed;
layout(location = 1) out uvec4 painted;

uvec4 texel(usampler2D data, uint index) {
  return texelFetch(data, ivec2(int(index) & ${TEXTURE_WIDTH - 1}, int(index) / ${TEXTURE_WIDTH}), 0);
}

vec4 companded(uint word) {
  int w = int(word);
  vec4 t = vec4(ivec4(w << 24, w << 16, w << 8, w) >> 24) / uHarmonicTop;
  return t * abs(t);
}

mat3 rotation(uint code) {
  vec3 q = vec3((uvec3(code) >> uvec3(20u, 10u, 0u)) & 1023u) / 1023.0 * 1.41421356237 - 0.70710678119;
  float largest = sqrt(max(0.0, 1.0 - dot(q, q)));
  uint which = code >> 30;
  vec4 p = which == 0u ? vec4(largest, q)
         : which == 1u ? vec4(q.x, largest, q.yz)
         : which == 2u ? vec4(q.xy, largest, q.z) : vec4(q, largest);  // wxyz
  float w = p.x, x = p.y, y = p.z, z = p.w;
  return mat3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
              2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
              2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

void main() {
  placed = uvec4(0u);
  painted = uvec4(0u);
  int place = uRange.x + int(gl_FragCoord.y) * ${TEXTURE_WIDTH} + int(gl_FragCoord.x);
  if (place >= uRange.y) return;
  uint index = texel(uOrder, uint(place)).x;
  uvec4 g0 = texel(uGeometry, index * 2u);
  uvec4 g1 = texel(uGeometry, index * 2u + 1u);

  vec3 mean = uintBitsToFloat(g0.xyz);
  vec3 p = uRotation * mean + uTranslation;
  if (!(p.z >= uNear)) return;
  float opacity = float(g1.y >> 16) / uScalarTop;
  if (any(lessThan(mean, uBoxLow)) || any(greaterThan(mean, uBoxHigh))) opacity *= uOutside;
  if (opacity < uMinAlpha) return;

  vec3 s = exp(mix(vec3(uLogScale.x), vec3(uLogScale.y),
                   vec3(g1.x & 65535u, g1.x >> 16, g1.y & 65535u) / uScalarTop));
  s = sqrt(s * s + uWidening);
  mat3 m = uRotation * rotation(g0.w);
  m = mat3(m[0] * s.x, m[1] * s.y, m[2] * s.z);
  vec2 tangent = clamp(p.xy / p.z, uTangents.xz, uTangents.yw);
  vec2 f = uIntrinsics.xy / p.z;
  // Rows of J·W·R·S; the covariance is its product with its own transpose.
  vec3 rows[3] = vec3[3](vec3(m[0].x, m[1].x, m[2].x), vec3(m[0].y, m[1].y, m[2].y), vec3(m[0].z, m[1].z, m[2].z));
  vec3 u = f.x * (rows[0] - tangent.x * rows[2]);
  vec3 v = f.y * (rows[1] - tangent.y * rows[2]);
  float xx = dot(u, u), xy = dot(u, v), yy = dot(v, v);
  float before = xx * yy - xy * xy;
  xx += uDilation;
  yy += uDilation;
  if (uCompensated) {
    opacity *= sqrt(max(0.0, before / (xx * yy - xy * xy)));
    if (opacity < uMinAlpha) return;
  }
  if (uSoftening > 0.0) {
    float sharp = xx * yy - xy * xy;
    xx += uSoftening;
    yy += uSoftening;
    opacity *= sqrt(max(0.0, sharp / (xx * yy - xy * xy)));
    if (opacity < uMinAlpha) return;
  }

  // Half axes where alpha falls to the cut-off, along the eigenvectors.
  float middle = 0.5 * (xx + yy);
  float radius = length(vec2(0.5 * (xx - yy), xy));
  float angle = 0.5 * atan(2.0 * xy, xx - yy);
  vec2 axis = vec2(cos(angle), sin(angle));
  vec2 sigma = sqrt(vec2(middle + radius, max(middle - radius, uDilation + uSoftening)));
  float reach = sqrt(max(0.0, 2.0 * log(opacity / uMinAlpha)));
  vec2 center = uIntrinsics.xy * p.xy / p.z + uIntrinsics.zw;
  // Colours are most of the work: not for what is beside the picture.
  float extent = reach * sigma.x;
  if (any(lessThan(center + extent, uClip.xy)) || any(greaterThan(center - extent, uClip.zw))) return;

  vec3 color = mix(vec3(uDc.x), vec3(uDc.y), vec3(g1.z & 65535u, g1.z >> 16, g1.w & 65535u) / uScalarTop);
  color = 0.28209479177387814 * color + 0.5;
  vec3 direction = normalize(mean - uEye);
  float x = direction.x, y = direction.y, z = direction.z;
  float x2 = x * x, y2 = y * y, z2 = z * z;
  ${harmonicsSource(degree)}
  color = max(color, 0.0);
  placed = floatBitsToUint(vec4(center, extent * axis));
  painted = uvec4(floatBitsToUint(vec2(reach * sigma.y, reach)), packHalf2x16(color.rg), packHalf2x16(vec2(color.b, opacity)));
}`;

const splatVertexSource = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;

uniform usampler2D uPlaced;
uniform usampler2D uPainted;
uniform int uCount;
uniform vec2 uSize;           // of the target, pixels
out vec2 vOffset;             // from the mean, in standard deviations
flat out vec4 vColor;         // rgb, opacity

void main() {
  gl_Position = vec4(0.0, 0.0, 2.0, 1.0);  // outside, until something is to be seen
  vOffset = vec2(0.0);
  vColor = vec4(0.0);
  int place = gl_InstanceID * ${QUADS_AT_ONCE} + (gl_VertexID >> 2);
  if (place >= uCount) return;
  ivec2 texel = ivec2(place & ${TEXTURE_WIDTH - 1}, place / ${TEXTURE_WIDTH});
  uvec4 painted = texelFetch(uPainted, texel, 0);
  vec2 reach = uintBitsToFloat(painted.xy);
  if (reach.y == 0.0) return;
  vec4 placed = uintBitsToFloat(texelFetch(uPlaced, texel, 0));
  vec2 corner = vec2(float(gl_VertexID & 1), float((gl_VertexID >> 1) & 1)) * 2.0 - 1.0;
  vec2 longer = placed.zw;
  vec2 shorter = reach.x * normalize(vec2(-longer.y, longer.x));
  vec2 pixel = placed.xy + corner.x * longer + corner.y * shorter;
  vOffset = corner * reach.y;
  vColor = vec4(unpackHalf2x16(painted.z), unpackHalf2x16(painted.w));
  gl_Position = vec4(pixel / uSize * vec2(2.0, -2.0) + vec2(-1.0, 1.0), 0.0, 1.0);
}`;

const splatFragmentSource = `#version 300 es
precision highp float;
uniform float uMinAlpha;
uniform float uMaxAlpha;
in vec2 vOffset;
flat in vec4 vColor;
out vec4 fragment;
void main() {
  float alpha = min(uMaxAlpha, vColor.a * exp(-0.5 * dot(vOffset, vOffset)));
  if (alpha < uMinAlpha) discard;
  fragment = vec4(vColor.rgb * alpha, alpha);
}`;

// A picture, where the camera would see it.
const pictureVertexSource = `#version 300 es
uniform vec4 uRectangle;      // left, top, width, height in pixels
uniform vec2 uSize;
out vec2 vTexture;
void main() {
  vTexture = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  vec2 pixel = uRectangle.xy + vTexture * uRectangle.zw;
  gl_Position = vec4(pixel / uSize * vec2(2.0, -2.0) + vec2(-1.0, 1.0), 0.0, 1.0);
}`;

const pictureFragmentSource = `#version 300 es
precision highp float;
uniform sampler2D uPicture;
in vec2 vTexture;
out vec4 fragment;
void main() { fragment = texture(uPicture, vTexture); }`;

const screenVertexSource = `#version 300 es
void main() {
  gl_Position = vec4(vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0, 0.0, 1.0);
}`;

// What is on screen: one of the two pictures on either side of a line, or how far they are apart; magnified under the
// lens. Pictures that are smaller than where they are shown fill it smoothly. Textures have y up, the page y down.
const screenFragmentSource = `#version 300 es
precision highp float;
uniform sampler2D uFirst, uSecond;          // premultiplied
uniform sampler2D uLensFirst, uLensSecond;
uniform vec2 uSize;                         // of the pictures, pixels
uniform vec2 uPixel;                        // how many of them, along either axis, are one here
uniform vec3 uBackground;
uniform vec2 uSplit;                        // first where x < uSplit.x or y < uSplit.y
uniform bool uDifference;
uniform float uDifferenceTop;               // mean absolute difference shown as the brightest colour
uniform vec3 uLenses[2];                    // x, y of the centre, radius; 0: none
uniform vec2 uLensSize;
out vec4 fragment;

vec4 at(sampler2D picture, vec2 place, vec2 size) {
  if (textureSize(picture, 0) == ivec2(size)) return texelFetch(picture, ivec2(floor(place)), 0);
  return textureLod(picture, place / size, 0.0);
}

vec3 over(vec4 c) { return clamp(c.rgb + (1.0 - c.a) * uBackground, 0.0, 1.0); }

vec3 heat(float t) {
  const vec3 stops[6] = vec3[6](vec3(0.02, 0.02, 0.03), vec3(0.21, 0.07, 0.36), vec3(0.55, 0.15, 0.41),
                                vec3(0.88, 0.33, 0.25), vec3(0.98, 0.66, 0.22), vec3(0.99, 0.98, 0.80));
  float x = clamp(t, 0.0, 1.0) * 5.0;
  int k = int(min(x, 4.0));
  return mix(stops[k], stops[k + 1], x - float(k));
}

vec3 shown(sampler2D first, sampler2D second, vec2 place, vec2 size, vec2 pixel) {
  if (uDifference) {
    vec3 apart = abs(over(at(first, place, size)) - over(at(second, place, size)));
    return heat(dot(apart, vec3(1.0 / 3.0)) / uDifferenceTop);
  }
  if (pixel.x < uSplit.x || pixel.y < uSplit.y) return over(at(first, place, size));
  return over(at(second, place, size));
}

void main() {
  vec2 place = gl_FragCoord.xy * uPixel;
  vec2 pixel = vec2(place.x, uSize.y - place.y);
  for (int k = 0; k < 2; ++k) {
    vec3 lens = uLenses[k];
    vec2 d = pixel - lens.xy;
    if (lens.z > 0.0 && dot(d, d) < lens.z * lens.z) {
      fragment = vec4(shown(uLensFirst, uLensSecond, vec2(d.x, -d.y) + 0.5 * uLensSize, uLensSize, pixel), 1.0);
      return;
    }
  }
  fragment = vec4(shown(uFirst, uSecond, place, uSize, pixel), 1.0);
}`;

// Pictures to compare with, from the bytes that PictureCache keeps: its Unpack. A thread is a pixel.

struct Bytes {
  background: vec3f,  // under colours that have alpha
  plane: u32,         // pixels
  channels: u32,      // 3, or 4 with alpha
  masked: u32,        // 1: behind the channels one more, which is not 0 where nothing is asked
}

@group(0) @binding(0) var<uniform> bytes: Bytes;
@group(0) @binding(1) var<storage, read> packed: array<u32>;        // u8 [channels + masked,H,W]
@group(0) @binding(2) var<storage, read_write> wanted: array<f32>;  // [3,H,W]

const IGNORED_BELOW = -1.0;

fn Byte(i: u32) -> u32 { return (packed[i / 4u] >> (8u * (i % 4u))) & 255u; }
fn Part(i: u32) -> f32 { return f32(Byte(i)) * (1.0 / 255.0); }

@compute @workgroup_size(256) fn unpack_picture(@builtin(workgroup_id) group: vec3u,
                                                @builtin(local_invocation_index) lane: u32) {
  let pixel = GroupNumber(group) * 256u + lane;
  let plane = bytes.plane;
  if (pixel >= plane) { return; }
  var color = vec3f(Part(pixel), Part(plane + pixel), Part(2u * plane + pixel));
  if (bytes.channels == 4u) {
    let alpha = Part(3u * plane + pixel);
    color = color * alpha + bytes.background * (1.0 - alpha);
  }
  if (bytes.masked != 0u && Byte(bytes.channels * plane + pixel) != 0u) { color = vec3f(IGNORED_BELOW); }
  wanted[pixel] = color.x;
  wanted[plane + pixel] = color.y;
  wanted[2u * plane + pixel] = color.z;
}

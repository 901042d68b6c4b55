// What every kernel is compiled with.

// The number of a workgroup: rows of 65,535 (gpu/device.h).
fn GroupNumber(group: vec3u) -> u32 { return group.y * 65535u + group.x; }

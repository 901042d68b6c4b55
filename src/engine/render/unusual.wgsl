// Rows that are left to the CPU, as what they hold leaves the range in which floats calculate well. How many there are,
// then the rows, in any order. No row is listed twice.
@group(0) @binding(8) var<storage, read_write> unusual: array<atomic<u32>>;

fn LeaveToCpu(row: u32) { atomicStore(&unusual[1u + atomicAdd(&unusual[0], 1u)], row); }

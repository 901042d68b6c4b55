// Rows left to the CPU, as their values exceed the range in which floats are accurate: the count, then the rows in any
// order, without duplicates.
@group(0) @binding(8) var<storage, read_write> unusual: array<atomic<u32>>;

fn LeaveToCpu(row: u32) { atomicStore(&unusual[1u + atomicAdd(&unusual[0], 1u)], row); }

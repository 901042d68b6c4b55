#pragma once

namespace anchorsplat {

struct OutputMemory;

// Options of all file writers.
struct WriteOptions {
  bool overwrite = false;          // false: an existing file is an error (kExists)
  OutputMemory* memory = nullptr;  // write files there instead of to a folder (io/output_memory.h)
};

}  // namespace anchorsplat

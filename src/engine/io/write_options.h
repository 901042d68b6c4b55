#pragma once

namespace anchorsplat {

struct OutputMemory;

// What all writers of files take.
struct WriteOptions {
  bool overwrite = false;          // an existing file is kExists otherwise
  OutputMemory* memory = nullptr;  // the files go there instead of a folder (io/output_memory.h)
};

}  // namespace anchorsplat

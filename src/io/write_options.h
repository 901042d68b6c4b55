#pragma once

namespace anchorsplat {

// What all writers of files take.
struct WriteOptions {
  bool overwrite = false;  // an existing file is kExists otherwise
};

}  // namespace anchorsplat

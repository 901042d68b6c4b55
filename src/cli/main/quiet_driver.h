#pragma once

#include <cstdlib>

namespace anchorsplat {

// Where no session of a desktop says where its sockets are, a layer of Mesa that looks for the desktop's GPU complains
// on stderr, once for every adapter. It is of no use there. To be called before there are threads.
inline void QuietDriver() {
  if (std::getenv("XDG_RUNTIME_DIR") == nullptr) setenv("NODEVICE_SELECT", "1", /*overwrite=*/0);
}

}  // namespace anchorsplat

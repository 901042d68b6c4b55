#pragma once

#include <cstdlib>

namespace anchorsplat {

// Where no session of a desktop says where its sockets are, a layer of Mesa that looks for the desktop's GPU complains
// on stderr, once for every adapter. It is of no use there. To be called before there are threads.
inline void QuietDriver() {
  const char* folder = std::getenv("XDG_RUNTIME_DIR");
  if (folder == nullptr || *folder == '\0') setenv("NODEVICE_SELECT", "1", /*overwrite=*/0);
}

}  // namespace anchorsplat

# For CMAKE_TOOLCHAIN_FILE: 64-bit ARM from another Debian machine, with the libraries of `dpkg --add-architecture arm64`.
# scripts/cross-aarch64.sh does all of it, tests under QEMU included.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64)
# pkg-config looks among this machine's own libraries otherwise.
set(ENV{PKG_CONFIG_LIBDIR} "/usr/lib/aarch64-linux-gnu/pkgconfig:/usr/share/pkgconfig")

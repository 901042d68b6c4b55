#pragma once

// ANCHORSPLAT_INCLUDE_BYTES(NAME, PATH): a file as constants of the program, from the symbol NAME up to NAME_end, which
// the source declares as extern "C" const std::byte[]. The assembler copies it: both compilers know this, C++20 has
// nothing for it.
#ifdef __wasm__
// Of WebAssembly: every section is a segment of its own, and a symbol of data says its size.
#define ANCHORSPLAT_INCLUDE_BYTES(NAME, PATH) \
  asm(".section .rodata." NAME                \
      ",\"\",@\n"                             \
      ".p2align 6\n"                          \
      ".globl " NAME "\n" NAME                \
      ":\n"                                   \
      ".incbin \"" PATH                       \
      "\"\n"                                  \
      ".globl " NAME "_end\n" NAME            \
      "_end:\n"                               \
      ".int8 0\n"                             \
      ".size " NAME ", " NAME "_end-" NAME    \
      "\n"                                    \
      ".size " NAME "_end, 1\n")
#else
#define ANCHORSPLAT_INCLUDE_BYTES(NAME, PATH) \
  asm(".section .rodata\n"                    \
      ".balign 64\n"                          \
      ".hidden " NAME                         \
      "\n"                                    \
      ".hidden " NAME                         \
      "_end\n"                                \
      ".globl " NAME                          \
      "\n"                                    \
      ".globl " NAME "_end\n" NAME            \
      ":\n"                                   \
      ".incbin \"" PATH "\"\n" NAME           \
      "_end:\n"                               \
      ".byte 0\n"                             \
      ".text\n")
#endif

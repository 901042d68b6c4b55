#pragma once

// ANCHORSPLAT_INCLUDE_BYTES(NAME, PATH) embeds a file as the bytes from symbol NAME up to NAME_end, to be declared as
// extern "C" const std::byte[]. Uses the assembler's .incbin, which GCC and Clang support; C++20 has no equivalent.
#ifdef __wasm__
// WebAssembly: each section is its own segment, and data symbols need a size.
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

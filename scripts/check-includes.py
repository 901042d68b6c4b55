#!/usr/bin/env python3
"""Every file includes the standard headers of what it uses, itself or through headers of ours: what another header of the
standard library happens to include differs between compilers, so that a file builds with one and not with the next.
Goes by the names below. `--fix` adds what is missing (clang-format sorts it afterwards)."""
import functools
import pathlib
import re
import subprocess
import sys

ALGORITHMS = """adjacent_find all_of any_of binary_search clamp copy copy_if copy_n count count_if equal fill fill_n find find_if
for_each generate is_sorted lexicographical_compare lower_bound max max_element merge min min_element minmax mismatch none_of
nth_element partial_sort partition remove_if replace replace_if reverse rotate search shuffle sort stable_sort transform unique
upper_bound""".split()
MATHS = """abs atan atan2 cbrt ceil cos exp exp2 expm1 fabs floor fmod hypot isfinite isinf isnan ldexp llround log log1p log2
lround nextafter pow round signbit sin sqrt tan tanh trunc""".split()


def calls(names):
    return r"\bstd::(?:ranges::)?(?:" + "|".join(names) + r")\s*[(<]"


USES = {
    "algorithm": calls(ALGORITHMS),
    "array": r"\bstd::array<",
    "atomic": r"\bstd::atomic\b",
    "bit": calls(["bit_cast", "bit_width", "countl_zero", "countr_zero", "has_single_bit", "popcount"]) + r"|\bstd::endian\b",
    "charconv": calls(["from_chars", "to_chars"]),
    "chrono": r"\bstd::chrono\b",
    "cmath": calls(MATHS),
    "cstdint": r"\bu?int(?:8|16|32|64)_t\b",
    "cstring": calls(["memcmp", "memcpy", "memmove", "memset", "strcmp", "strerror", "strlen"]),
    "filesystem": r"\bstd::filesystem\b",
    "fstream": r"\bstd::[io]?fstream\b",
    "functional": r"\bstd::(?:function|greater|less)\b",
    "iostream": r"\bstd::(?:cerr|cin|cout)\b",
    "iterator": calls(["back_inserter", "distance", "next", "prev"]),
    "limits": r"\bstd::numeric_limits\b",
    "map": r"\bstd::(?:multi)?map<",
    "memory": r"\bstd::(?:make_shared|make_unique|shared_ptr|unique_ptr|weak_ptr)\b",
    "mutex": r"\bstd::(?:lock_guard|mutex|scoped_lock|unique_lock)\b",
    "numeric": calls(["accumulate", "gcd", "inner_product", "iota", "reduce"]),
    "optional": r"\bstd::(?:nullopt|optional)\b",
    "set": r"\bstd::(?:multi)?set<",
    "span": r"\bstd::span<",
    "sstream": r"\bstd::[io]?stringstream\b",
    "string": r"\bstd::(?:string|to_string)\b",
    "string_view": r"\bstd::string_view\b",
    "thread": r"\bstd::thread\b",
    "utility": r"\bstd::(?:exchange|forward|move|pair|swap)\b",
    "variant": r"\bstd::(?:get_if|holds_alternative|variant|visit)\b",
    "vector": r"\bstd::vector<",
}
PATTERNS = {header: re.compile(pattern) for header, pattern in USES.items()}


@functools.cache
def text_of(path):
    return path.read_text(encoding="utf-8")


@functools.cache
def included(path, above=()):
    """Standard headers that a file gets by itself and through ours."""
    text, headers = text_of(path), set()
    headers.update(re.findall(r"^#include <([a-z_]+)>", text, re.M))
    for name in re.findall(r'^#include "([^"]+)"', text, re.M):
        for folder in (*pathlib.Path("src").iterdir(), pathlib.Path("include"), path.parent):
            ours = folder / name
            if ours.is_file() and ours not in above:
                headers |= included(ours, above + (path,))
                break
    return frozenset(headers)


def add(path, header):
    lines = text_of(path).split("\n")
    at = next((i for i, line in enumerate(lines) if line.startswith("#include <")), None)
    if at is not None:
        lines.insert(at, f"#include <{header}>")
    else:
        at = next(i for i, line in enumerate(lines) if line.startswith(("#pragma once", "#include")))
        lines[at + 1:at + 1] = ["", f"#include <{header}>"]
    path.write_text("\n".join(lines), encoding="utf-8")
    text_of.cache_clear()


def main():
    fix = sys.argv[1:] == ["--fix"]
    root = pathlib.Path(__file__).resolve().parent.parent
    names = subprocess.check_output(["git", "-C", root, "ls-files", "src/*.h", "src/*.cc", "include/*.h"],
                                    text=True).split()
    missing = 0
    for path in map(pathlib.Path, names):
        code = re.sub(r"//.*", "", text_of(path))
        for header, pattern in PATTERNS.items():
            if header not in included(path) and pattern.search(code):
                missing += 1
                print(f"{path}: uses <{header}> without including it")
                if fix:
                    add(path, header)
    sys.exit(1 if missing and not fix else 0)


if __name__ == "__main__":
    import os
    os.chdir(pathlib.Path(__file__).resolve().parent.parent)
    main()

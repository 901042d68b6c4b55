#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/random.h"

namespace anchorsplat {

// Makes a damaged file from good ones by one to four mutations: flipped bits, replaced bytes and integers, lost,
// repeated and inserted blocks, truncation, the tail of another file, changed numbers in text, lines dropped,
// duplicated or swapped, words of the format (`words`) in the wrong place. Deterministic in `random` on every machine.
// At most kMaxMutant bytes.
inline constexpr size_t kMaxMutant = size_t{1} << 20;
std::string Mutate(std::span<const std::string> seeds, std::span<const std::string_view> words, Random& random);

}  // namespace anchorsplat

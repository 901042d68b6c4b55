#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/random.h"

namespace anchorsplat {

// A broken file made from good ones: one to four of the damages that files suffer or that attackers do – flipped bits,
// set bytes and integers, lost, repeated and inserted blocks, a cut end, the tail of another file, other numbers in
// text, lines dropped, doubled, swapped, words of the format (`words`) in the wrong place. The same `random` gives the
// same file on every machine. At most kMaxMutant bytes.
inline constexpr size_t kMaxMutant = size_t{1} << 20;
std::string Mutate(std::span<const std::string> seeds, std::span<const std::string_view> words, Random& random);

}  // namespace anchorsplat

#include "formats/fuzz/mutation.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace anchorsplat {

namespace {

constexpr std::array<std::string_view, 24> kNumbers = {"0",
                                                       "-1",
                                                       "1",
                                                       "2",
                                                       "7",
                                                       "255",
                                                       "256",
                                                       "65536",
                                                       "2147483647",
                                                       "2147483648",
                                                       "4294967295",
                                                       "4294967296",
                                                       "9223372036854775807",
                                                       "18446744073709551616",
                                                       "1e30",
                                                       "1e308",
                                                       "1e999",
                                                       "-1e-999",
                                                       "nan",
                                                       "inf",
                                                       "-inf",
                                                       "0x10",
                                                       "",
                                                       "1.5"};
constexpr std::array<uint64_t, 14> kIntegers = {0,          1,          0x7f,       0x80,       0xff,
                                                0x7fff,     0x8000,     0xffff,     0x7fffffff, 0x80000000,
                                                0xffffffff, 0x7fc00000, 0x7f800000, UINT64_MAX};

// A random index of `text`, biased towards headers.
size_t Place(const std::string& text, Random& random) {
  if (text.empty()) return 0;
  const auto size = static_cast<int64_t>(text.size());
  return static_cast<size_t>(random.Below(random.Below(2) == 0 ? size : std::min<int64_t>(size, 1024)));
}

size_t Length(size_t available, Random& random) {
  if (available == 0) return 0;
  const auto longest = static_cast<int64_t>(available);
  return static_cast<size_t>(1 + random.Below(random.Below(3) == 0 ? longest : std::min<int64_t>(longest, 64)));
}

void FlipBits(std::string& text, Random& random) {
  for (int64_t n = 1 + random.Below(8); n > 0 && !text.empty(); --n) {
    char& c = text[Place(text, random)];
    c = static_cast<char>(c ^ (1 << random.Below(8)));
  }
}

void SetBytes(std::string& text, Random& random) {
  for (int64_t n = 1 + random.Below(4); n > 0 && !text.empty(); --n) {
    text[Place(text, random)] = static_cast<char>(random.Next());
  }
}

// Replaces 1, 2, 4 or 8 bytes by an edge-case integer in either byte order, as lengths and counts may be anywhere.
void SetInteger(std::string& text, Random& random) {
  const size_t size = size_t{1} << random.Below(4);
  if (text.size() < size) return;
  uint64_t value = kIntegers[static_cast<size_t>(random.Below(kIntegers.size()))];
  if (random.Below(4) == 0) value = static_cast<uint64_t>(random.Below(1 << 20));
  const bool big = random.Below(2) == 0;
  const size_t at = std::min(Place(text, random), text.size() - size);
  for (size_t k = 0; k < size; ++k) text[at + (big ? size - 1 - k : k)] = static_cast<char>(value >> (8 * k));
}

void CutEnd(std::string& text, Random& random) { text.resize(Place(text, random)); }

void Extend(std::string& text, Random& random) {
  for (int64_t n = random.Below(256); n > 0; --n) text += static_cast<char>(random.Next());
}

void RemoveBlock(std::string& text, Random& random) {
  const size_t at = Place(text, random);
  text.erase(at, Length(text.size() - at, random));
}

void RepeatBlock(std::string& text, Random& random) {
  const size_t at = Place(text, random);
  const std::string block = text.substr(at, Length(text.size() - at, random));
  text.insert(random.Below(2) == 0 ? at : Place(text, random), block);
}

void Splice(std::string& text, std::span<const std::string> seeds, Random& random) {
  const std::string& other = seeds[static_cast<size_t>(random.Below(static_cast<int64_t>(seeds.size())))];
  const size_t from = Place(other, random);
  text.resize(Place(text, random));
  text += random.Below(2) == 0 ? other.substr(from) : other.substr(std::min(text.size(), other.size()));
}

bool InNumber(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '+' || c == 'e';
}

void ChangeNumber(std::string& text, Random& random) {
  const size_t from = text.find_first_of("0123456789", Place(text, random));
  if (from == std::string::npos) return;
  size_t begin = from, end = from;
  while (begin > 0 && InNumber(text[begin - 1])) --begin;
  while (end < text.size() && InNumber(text[end])) ++end;
  text.replace(begin, end - begin, kNumbers[static_cast<size_t>(random.Below(kNumbers.size()))]);
}

// [begin, end) of the line around a position, including its line end.
std::pair<size_t, size_t> LineAt(const std::string& text, size_t at) {
  const size_t before = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  const size_t begin = before == std::string::npos ? 0 : before + 1;
  const size_t after = text.find('\n', at);
  return {begin, after == std::string::npos ? text.size() : after + 1};
}

void ChangeLines(std::string& text, Random& random) {
  const auto [begin, end] = LineAt(text, Place(text, random));
  const std::string line = text.substr(begin, end - begin);
  switch (random.Below(3)) {
    case 0:
      text.erase(begin, end - begin);
      return;
    case 1:
      text.insert(begin, line);
      return;
    default:
      text.erase(begin, end - begin);
      text.insert(LineAt(text, Place(text, random)).first, line);
      return;
  }
}

void PutWord(std::string& text, std::span<const std::string_view> words, Random& random) {
  if (words.empty()) return;
  const std::string_view word = words[static_cast<size_t>(random.Below(static_cast<int64_t>(words.size())))];
  const auto is_letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  const auto found = std::find_if(text.begin() + static_cast<ptrdiff_t>(Place(text, random)), text.end(), is_letter);
  const auto end = std::find_if_not(found, text.end(), is_letter);
  const auto at = static_cast<size_t>(found - text.begin());
  text.replace(at, random.Below(4) == 0 ? 0 : static_cast<size_t>(end - found), word);
}

}  // namespace

std::string Mutate(std::span<const std::string> seeds, std::span<const std::string_view> words, Random& random) {
  std::string text = seeds[static_cast<size_t>(random.Below(static_cast<int64_t>(seeds.size())))];
  for (int64_t n = 1 + random.Below(4); n > 0; --n) {
    switch (random.Below(11)) {
      case 0:
        FlipBits(text, random);
        break;
      case 1:
        SetBytes(text, random);
        break;
      case 2:
        SetInteger(text, random);
        break;
      case 3:
        CutEnd(text, random);
        break;
      case 4:
        Extend(text, random);
        break;
      case 5:
        RemoveBlock(text, random);
        break;
      case 6:
        RepeatBlock(text, random);
        break;
      case 7:
        Splice(text, seeds, random);
        break;
      case 8:
        ChangeNumber(text, random);
        break;
      case 9:
        ChangeLines(text, random);
        break;
      default:
        PutWord(text, words, random);
        break;
    }
  }
  if (text.size() > kMaxMutant) text.resize(kMaxMutant);
  return text;
}

}  // namespace anchorsplat

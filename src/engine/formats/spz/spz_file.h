#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/result.h"
#include "formats/axes.h"
#include "formats/cloud_io.h"
#include "formats/spz/spz_extensions.h"
#include "formats/spz/spz_sections.h"
#include "io/inflating_reader.h"
#include "io/input_file.h"

namespace anchorsplat {

// An SPZ file whose header has been read and checked: spz_reader.h has the two kinds.
struct SpzFile {
  SpzLayout layout;
  int64_t count = 0;
  bool antialiased = false;
  uint8_t unknown_flags = 0;
  bool reserved_used = false;  // bytes that are to be zero are not
  uint64_t passed_over = 0;    // bytes where records would be, and are none; the header does not promise them
  std::vector<SpzExtension> extensions;
  Axes axes = kRub;  // of the numbers in the file, as a record says
  // What follows the sections of that stream has been read: records and its end.
  bool end_read = false;
  // Versions 1 to 3: the one stream of all sections, behind its header. Null for version 4:
  std::unique_ptr<CopyableReader> stream;
  // of section k of kSpzSections are bytes begins[k] to begins[k + 1].
  std::array<uint64_t, 7> begins{};

  int sh_degree() const;    // of a cloud
  size_t sections() const;  // those with bytes; the harmonics are the last
};

// Errors as ReadSpz, but for those of the sections.
Result<SpzFile> OpenSpz(const InputFile& file, const ReadLimits& limits);

// From the file's axes to the cloud's: signs while it is unpacked, and the rest afterwards.
struct SpzTurn {
  AxisFlip flip;
  AxisTurn turn;
};
SpzTurn TurnOfSpz(const SpzFile& spz);

// Says what of it will not be read.
void WarnOfSpz(const InputFile& file, const SpzFile& spz);

}  // namespace anchorsplat

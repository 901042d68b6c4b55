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

// An SPZ file with its header read and checked (spz_reader.h describes both kinds).
struct SpzFile {
  SpzLayout layout;
  int64_t count = 0;
  bool antialiased = false;
  uint8_t unknown_flags = 0;
  bool reserved_used = false;  // reserved bytes are not zero
  uint64_t skipped_bytes = 0;  // unclaimed bytes that are not records
  std::vector<SpzExtension> extensions;
  Axes axes = kRub;  // of the file's numbers, from a record or the default
  // Whether records and end of the stream after the sections have been read.
  bool end_read = false;
  // Versions 1 to 3: the stream of all sections, positioned after its header. Version 4: null.
  std::unique_ptr<CopyableReader> stream;
  // Section k of kSpzSections is bytes begins[k] to begins[k + 1] of version 4.
  std::array<uint64_t, 7> begins{};

  int sh_degree() const;    // of the cloud
  size_t sections() const;  // non-empty sections; harmonics come last
};

// Errors: those of ReadSpz except for sections.
Result<SpzFile> OpenSpz(const InputFile& file, const ReadLimits& limits);

// Conversion from the file's axes: sign changes while unpacking, and the rest afterwards.
struct SpzTurn {
  AxisFlip flip;
  AxisTurn turn;
};
SpzTurn TurnOfSpz(const SpzFile& spz);

// Warns of contents that will not be read.
void WarnOfSpz(const InputFile& file, const SpzFile& spz);

}  // namespace anchorsplat

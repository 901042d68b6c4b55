#pragma once

#include <cstring>
#include <memory>
#include <span>
#include <string>

#include "core/cloud_blocks.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "core/statistics.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

using ReadFunction = Result<GaussianCloud> (*)(const InputFile&, const ReadLimits&);
using BlocksFunction = Result<std::unique_ptr<CloudBlocks>> (*)(const InputFile&, const ReadLimits&);

// Compares a file's blocks, read twice, with `read`, the result of reading it whole: describes the first difference in
// values or errors; empty if equal or if the file has no blocks.
inline std::string DifferenceOfBlocks(BlocksFunction open, const InputFile& file, const ReadLimits& limits,
                                      const Result<GaussianCloud>& read) {
  const auto blocks = open(file, limits);
  if (blocks.ok() && *blocks == nullptr) return {};
  for (int pass = 0; pass < 2; ++pass) {
    GaussianCloud shown;
    Buffer<uint8_t> usable;
    Buffer<int> times;
    const auto copy = [](std::span<const float> from, Buffer<float>& to, int64_t at) {
      if (!from.empty()) std::memcpy(to.data() + at, from.data(), from.size_bytes());
    };
    Status status = blocks.ok() ? Status() : Status(blocks.error());
    if (status.ok()) {
      shown.Resize((*blocks)->size(), 0);
      usable.resize(static_cast<size_t>(shown.size()));
      times.assign(usable.size(), 0);
      status = (*blocks)->ForEach([&](const CloudBlock& block) {
        copy(block.rows.means, shown.means, 3 * block.first);
        copy(block.rows.log_scales, shown.log_scales, 3 * block.first);
        copy(block.rows.quats, shown.quats, 4 * block.first);
        copy(block.rows.opacity_logits, shown.opacity_logits, block.first);
        copy(block.rows.sh, shown.sh, 3 * block.first);
        for (int64_t i = 0; i < block.size(); ++i) {
          usable[static_cast<size_t>(block.first + i)] = block.usable[static_cast<size_t>(i)];
          ++times[static_cast<size_t>(block.first + i)];
        }
      });
    }
    if (status.ok() != read.ok()) return read.ok() ? Cat("an error: ", status.error().message) : "no error";
    if (!status.ok()) {
      const bool same = status.error().message == read.error().message && status.error().code == read.error().code;
      if (!same) return Cat("\"", status.error().message, "\" instead of \"", read.error().message, "\"");
      if (!blocks.ok()) return {};
      continue;
    }
    if (shown.size() != read->size() || (*blocks)->sh_degree() != read->sh_degree) return "another size or degree";
    if ((*blocks)->render_mode() != read->render_mode) return "another render mode";
    if ((*blocks)->comments() != read->comments) return "other comments";
    if ((*blocks)->origin() != read->origin) return "another origin";
    const GaussianCloud flat = WithShDegree(*read, 0);
    for (const auto array : {&GaussianCloud::means, &GaussianCloud::log_scales, &GaussianCloud::quats,
                             &GaussianCloud::opacity_logits, &GaussianCloud::sh}) {
      if (std::memcmp((shown.*array).data(), (flat.*array).data(), (flat.*array).size() * sizeof(float)) != 0) {
        return Cat("other values in pass ", pass);
      }
    }
    for (int64_t i = 0; i < read->size(); ++i) {
      if (times[static_cast<size_t>(i)] != 1) return Cat("row ", i, " ", times[static_cast<size_t>(i)], " times");
      if ((usable[static_cast<size_t>(i)] != 0) != IsUsable(*read, i)) return Cat("row ", i, ": another usable");
    }
  }
  return {};
}

}  // namespace anchorsplat

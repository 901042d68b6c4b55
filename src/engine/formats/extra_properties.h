#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/axes.h"
#include "formats/cloud_io.h"
#include "formats/ply/ply_header.h"

namespace anchorsplat {

// Per-Gaussian PLY properties that are not part of a Gaussian: labels, confidences, normals. Their values are not
// interpreted; they follow their Gaussians through selection and sorting and are written again.
struct ExtraProperties {
  struct Property {
    std::string name;
    PlyType type = PlyType::kFloat;
  };
  std::vector<Property> properties;  // scalars in file order, without normals
  Buffer<std::byte> rows;            // [N, row_size()] packed values, little-endian
  Buffer<float> normals;             // [N,3]; empty if absent or all zero
  // [N,3] exact world positions, if means are rounded differences to the cloud's origin; else empty.
  Buffer<double> world;
  float full_color = 0;  // full intensity assumed for red green blue in place of f_dc_*; 0: the file has f_dc
  std::vector<std::string> not_kept;  // what no writer can store, for messages: `list "neighbours"`

  size_t row_size() const;  // bytes
  bool empty() const { return properties.empty() && normals.empty() && world.empty(); }
  bool fits(int64_t gaussians) const;  // one row per Gaussian
  // For messages: "label, confidence, normals".
  std::string names() const;
  // What is not written, for messages: `not_kept`, and everything if the writer stores no extras.
  std::string lost(bool writer_keeps) const;
};

// Keeps rows with keep[i] set, in order.
void KeepRows(ExtraProperties& extras, const std::vector<char>& keep);
// Moves old row rows[i] to row i; `rows` is a permutation.
void ReorderRows(ExtraProperties& extras, const Buffer<uint32_t>& rows);
// Converts normals to other axes; other properties with a direction are unknown.
void TurnAxes(ExtraProperties& extras, const AxisTurn& turn);

// WriteCloud (cloud_io.h) with extra properties in the order of the cloud. Formats that cannot store them drop them
// with a warning.
Status WriteCloud(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options,
                  const ExtraProperties& extras);

}  // namespace anchorsplat

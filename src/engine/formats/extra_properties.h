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

// What a PLY says of each Gaussian beside what a Gaussian is: labels, confidences, normals. Nobody here looks at these
// values; they are read, follow their Gaussians through selection and sorting, and are written again.
struct ExtraProperties {
  struct Property {
    std::string name;
    PlyType type = PlyType::kFloat;
  };
  std::vector<Property> properties;  // scalars in the order of the file, without normals
  Buffer<std::byte> rows;            // [N, row_size()] the values one after the other, little-endian
  Buffer<float> normals;             // [N,3]; empty where there are none, or where all are zero
  // [N,3] world positions as the file has them, of which the means are rounded differences to the cloud's origin; empty
  // where means are all there is to know.
  Buffer<double> world;
  float full_color = 0;  // what red green blue in the place of f_dc_* were taken to have at most; 0: there is f_dc
  std::vector<std::string> not_kept;  // what no writer has a place for, for messages: `list "neighbours"`

  size_t row_size() const;  // bytes
  bool empty() const { return properties.empty() && normals.empty() && world.empty(); }
  bool fits(int64_t gaussians) const;  // has a row for each of them
  // For messages: "label, confidence, normals".
  std::string names() const;
  // What is not written, for messages: `not_kept`, and all the rest where the writer keeps no extras.
  std::string lost(bool writer_keeps) const;
};

// The rows for which keep[i] is set; their order stays.
void KeepRows(ExtraProperties& extras, const std::vector<char>& keep);
// Row i becomes the old row rows[i]; a permutation.
void ReorderRows(ExtraProperties& extras, const Buffer<uint32_t>& rows);
// Normals along other axes. What else may have a direction is not known.
void TurnAxes(ExtraProperties& extras, const AxisTurn& turn);

// WriteCloud (cloud_io.h) with what the input says of the same Gaussians beside them, in the order of the cloud.
// Formats without a place for it leave it out, and a warning names it.
Status WriteCloud(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options,
                  const ExtraProperties& extras);

}  // namespace anchorsplat

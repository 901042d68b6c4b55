#include <array>
#include <bit>
#include <string>
#include <string_view>
#include <vector>

#include "core/buffer.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/tables/table_writers.h"
#include "io/atomic_file.h"
#include "io/zip_archive.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

// Header of a .npy file of version 1.0: a Python dictionary, padded to a multiple of 64 bytes.
std::string NpyHeader(const std::string& shape, const char* type = "<f4") {
  std::string text = Cat("{'descr': '", type, "', 'fortran_order': False, 'shape': (", shape, "), }");
  constexpr size_t kPreamble = 10;
  text.append(63 - (kPreamble + text.size()) % 64, ' ');
  text += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(text.size() & 255);
  header += static_cast<char>(text.size() >> 8);
  return header + text;
}

struct Array {
  const char* name;
  std::string shape;
  uint64_t floats;
  const float* values;
};

std::array<Array, 5> Arrays(const CloudView& cloud, int64_t n, int degree) {
  const auto count = static_cast<uint64_t>(n);
  const auto coefficients = static_cast<uint64_t>(ShCoefficients(degree));
  return {{{"means.npy", Cat(n, ", 3"), 3 * count, cloud.means.data()},
           {"log_scales.npy", Cat(n, ", 3"), 3 * count, cloud.log_scales.data()},
           {"quats.npy", Cat(n, ", 4"), 4 * count, cloud.quats.data()},
           {"opacity_logits.npy", Cat(n, ","), count, cloud.opacity_logits.data()},
           {"sh.npy", Cat(n, ", ", coefficients, ", 3"), 3 * coefficients * count, cloud.sh.data()}}};
}

// World positions as doubles.
Status AddWorld(ZipWriter& archive, const Array& array, const CloudView& cloud) {
  Buffer<double> world(cloud.means.size());
  for (size_t k = 0; k < world.size(); ++k) world[k] = cloud.origin[k % 3] + double{cloud.means[k]};
  const std::string header = NpyHeader(array.shape, "<f8");
  const std::string_view parts[] = {header,
                                    {reinterpret_cast<const char*>(world.data()), sizeof(double) * world.size()}};
  return archive.Add(array.name, parts);
}

}  // namespace

// Valid below 4 GiB, where no member needs zip64.
uint64_t PredictedNpzSize(int64_t count, int sh_degree) {
  uint64_t size = 22;
  for (const Array& array : Arrays({}, count, sh_degree)) {
    size += 30 + 46 + 2 * std::string_view(array.name).size() + NpyHeader(array.shape).size() + 4 * array.floats;
  }
  return size;
}

Status WriteNpz(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, cloud));
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  ZipWriter archive(file);
  for (const Array& array : Arrays(cloud, cloud.size(), cloud.sh_degree)) {
    if (array.values == cloud.means.data() && !IsZero(cloud.origin)) {
      ANCHORSPLAT_RETURN_IF_ERROR(AddWorld(archive, array, cloud));
      continue;
    }
    const std::string header = NpyHeader(array.shape);
    const std::string_view parts[] = {
        header, {reinterpret_cast<const char*>(array.values), static_cast<size_t>(4 * array.floats)}};
    ANCHORSPLAT_RETURN_IF_ERROR(archive.Add(array.name, parts));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(archive.Finish());
  return file.Commit();
}

}  // namespace anchorsplat

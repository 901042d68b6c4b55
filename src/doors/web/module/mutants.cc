// Writes damaged files of all readable formats in one file: web_mutants OUT COUNT SEED. Each is preceded by its length,
// 4 bytes, little-endian.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <system_error>
#include <vector>

#include "core/random.h"
#include "formats/fuzz/mutation.h"
#include "formats/fuzz/readers.h"

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "web_mutants OUT COUNT SEED\n";
    return 2;
  }
  std::error_code failed;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(failed) / "anchorsplat-web-mutants";
  std::filesystem::create_directories(folder, failed);
  const std::vector<anchorsplat::FuzzReader> readers = anchorsplat::FuzzReaders(folder);
  anchorsplat::Random random(std::strtoull(argv[3], nullptr, 10));
  std::ofstream out(argv[1], std::ios::binary);
  const size_t count = std::strtoull(argv[2], nullptr, 10);
  for (size_t k = 0; k < count && !readers.empty(); ++k) {
    const anchorsplat::FuzzReader& reader = readers[k % readers.size()];
    const std::string file = anchorsplat::Mutate(reader.seeds, reader.words, random);
    for (int byte = 0; byte < 4; ++byte) out.put(static_cast<char>(file.size() >> (8 * byte)));
    out.write(file.data(), static_cast<std::streamsize>(file.size()));
  }
  std::filesystem::remove_all(folder, failed);
  return out.flush() ? 0 : 1;
}

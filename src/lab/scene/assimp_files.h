#pragma once

#include <assimp/IOSystem.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

namespace anchorsplat {

// The bytes of the file of that name; nothing when there is none.
using AssimpFileReader = std::function<std::optional<std::string>(const std::string& name)>;

// Files as assimp opens them, read-only and in memory, so that the same code reads folders and archives.
class AssimpFiles : public Assimp::IOSystem {
 public:
  explicit AssimpFiles(AssimpFileReader read) : read_(std::move(read)) {}

  bool Exists(const char* name) const override { return read_(name).has_value(); }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char* mode) override;
  void Close(Assimp::IOStream* stream) override;

 private:
  AssimpFileReader read_;
};

// Makes blank what is no face in an OBJ file: line elements (`l`), points (`p`), and the statements whose names begin
// with these letters, `lod` and `parm`, as assimp 5.2 goes by the letter alone. It refuses files in which such lines
// refer to vertices in ways it does not expect, and a view shows none of them. Blank, not gone, so that line numbers in
// messages stay right. Gives the number of line elements and points; lines joined by a backslash are one.
int64_t BlankLinesAndPoints(std::string& obj);

}  // namespace anchorsplat

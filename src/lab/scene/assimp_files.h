#pragma once

#include <assimp/IOSystem.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

namespace anchorsplat {

// Returns the bytes of a file, or nothing if it does not exist.
using AssimpFileReader = std::function<std::optional<std::string>(const std::string& name)>;

// assimp's file interface, read-only and in memory, so that folders and archives are read alike.
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

// Blanks out lines of an OBJ that are no faces: line elements (`l`), points (`p`), and statements that start with these
// letters (`lod`, `parm`), which assimp 5.2 confuses with them. assimp rejects files where such lines refer to vertices
// in unexpected ways, and no view shows them. Line numbers stay valid. Returns the number of line elements and points;
// lines joined by a backslash count once.
int64_t BlankLinesAndPoints(std::string& obj);

}  // namespace anchorsplat

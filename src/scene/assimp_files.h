#pragma once

#include <assimp/IOSystem.hpp>
#include <memory>
#include <string>
#include <vector>

#include "scene/asset_source.h"

namespace anchorsplat {

// The files of an AssetSource as assimp opens them, read-only and in memory, so that the same code reads folders and
// archives. Every file is at most `max_bytes` long; what is longer does not exist.
//
// Wavefront OBJ files are cleaned on the way (BlankLinesAndPoints).
class AssimpFiles : public Assimp::IOSystem {
 public:
  // Names that were asked for in vain go to `missing`, each once.
  AssimpFiles(const AssetSource* source, uint64_t max_bytes, std::vector<std::string>* missing)
      : source_(source), max_bytes_(max_bytes), missing_(missing) {}

  bool Exists(const char* name) const override;
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char* mode) override;
  void Close(Assimp::IOStream* stream) override;

 private:
  const AssetSource* source_;
  uint64_t max_bytes_;
  std::vector<std::string>* missing_;
};

// Makes blank what is no face in an OBJ file: line elements (`l`), points (`p`), and the statements whose names begin
// with these letters, `lod` and `parm`, as assimp 5.2 goes by the letter alone. It refuses files in which such lines
// refer to vertices in ways it does not expect, and a view shows none of them. Blank, not gone, so that line numbers in
// messages stay right. Gives the number of line elements and points; lines joined by a backslash are one.
int64_t BlankLinesAndPoints(std::string& obj);

}  // namespace anchorsplat

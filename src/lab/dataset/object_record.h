#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_settings.h"
#include "scene/mesh_import.h"

namespace anchorsplat {

// Record of an object: a line of manifest.jsonl, and record.json in the object's folder.
struct ObjectRecord {
  std::string name;    // of its folder
  std::string source;  // the mesh's address or the folder of pictures, as given
  std::string recipe;  // recipe entry; empty: none
  MeshOrigin origin;   // name, category, creator, licence and the file that states it
  std::string stem;    // VariantStem
  std::string fingerprint;
  ObjectSettings settings;

  int views = 0;  // per resolution; these four come from the settings for meshes, from the pictures otherwise
  int low_size = 0;
  int high_size = 0;
  std::array<float, 3> background = {0, 0, 0};
  int64_t triangles = 0;
  int64_t textures = 0;
  int64_t transparent_triangles = 0;  // left out
  int64_t initial_points = 0;
  int64_t gaussians = 0;
  double train_psnr = 0;  // dB, of the splat on its fit's training views
  double train_ssim = 0;
  double held_out_psnr = 0;  // 0 if none are held out
  double held_out_ssim = 0;
  bool rejected = false;  // kept on disk, but not part of the data set
  std::string reason;     // for the rejection
  // Wall-clock seconds, the only members that vary between builds.
  double read_seconds = 0;
  double view_seconds = 0;
  double fit_seconds = 0;
};

nlohmann::json ToJson(const ObjectRecord& record);
Result<ObjectRecord> ObjectRecordFrom(const JsonValue& json);

inline constexpr const char* kManifestName = "manifest.jsonl";
inline constexpr const char* kRecordName = "record.json";
inline constexpr const char* kFailuresName = "failures.jsonl";

// By name. Errors (kBadFile) name the line.
using Manifest = std::map<std::string, ObjectRecord>;
Result<Manifest> ReadManifest(const std::filesystem::path& dataset);
// Writes atomically; replaces an existing file.
Status WriteManifest(const std::filesystem::path& dataset, const Manifest& manifest);

// Records of all finished objects in the folder, regardless of the manifest.
Result<Manifest> CollectRecords(const std::filesystem::path& dataset);

// An object that could not be built.
struct ObjectFailure {
  std::string name;
  std::string source;
  std::string stage;    // "mesh", "views", "fit", "files"; of derived objects "base" or the processing
  std::string message;  // one sentence
};
Status WriteFailures(const std::filesystem::path& dataset, const std::vector<ObjectFailure>& failures);
Result<std::vector<ObjectFailure>> ReadFailures(const std::filesystem::path& dataset);  // empty without a file

}  // namespace anchorsplat

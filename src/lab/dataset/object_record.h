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

// What a data set says about one of its objects: a line of manifest.jsonl, and record.json in the object's folder.
struct ObjectRecord {
  std::string name;    // of its folder
  std::string source;  // the mesh's address, or the folder of pictures, as it was given
  std::string recipe;  // the entry of the recipe it was made by; empty: none
  MeshOrigin origin;   // name, category, creator, licence and which file says so
  std::string stem;    // VariantStem
  std::string fingerprint;
  ObjectSettings settings;

  int views = 0;  // of each resolution; these four are the settings' for meshes, the pictures' own for others
  int low_size = 0;
  int high_size = 0;
  std::array<float, 3> background = {0, 0, 0};
  int64_t triangles = 0;
  int64_t textures = 0;
  int64_t transparent_triangles = 0;  // left out
  int64_t initial_points = 0;
  int64_t gaussians = 0;
  double train_psnr = 0;  // dB, of the object's splat on the training views of its fit
  double train_ssim = 0;
  double held_out_psnr = 0;  // 0 when none are held out
  double held_out_ssim = 0;
  bool rejected = false;  // kept on disk, but no part of the data set
  std::string reason;     // for that
  // The only members that differ from one build to the next: seconds on the clock.
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
// Whole or not at all; replaces an older one.
Status WriteManifest(const std::filesystem::path& dataset, const Manifest& manifest);

// Records of all finished objects in the folder, whatever the manifest says.
Result<Manifest> CollectRecords(const std::filesystem::path& dataset);

// An object that could not be made.
struct ObjectFailure {
  std::string name;
  std::string source;
  std::string stage;    // "mesh", "views", "fit", "files"; of those made from another: "base" or what becomes of it
  std::string message;  // one sentence
};
Status WriteFailures(const std::filesystem::path& dataset, const std::vector<ObjectFailure>& failures);
Result<std::vector<ObjectFailure>> ReadFailures(const std::filesystem::path& dataset);  // none where there is no file

}  // namespace anchorsplat

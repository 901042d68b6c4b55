#pragma once

#include <filesystem>
#include <optional>

#include "core/camera.h"
#include "core/result.h"
#include "io/json_file.h"

namespace anchorsplat {

// nerfstudio turns, centres and scales cameras before it trains, and exports splats as they were trained. What it did
// stands in dataparser_transforms.json in the folder of a run (outputs/NAME/METHOD/DATE): p ↦ scale · transform · p,
// from the world of the original data. That is the COLMAP model's; a transforms.json may lie elsewhere already, by its
// applied_transform and applied_scale.
inline constexpr const char* kNerfstudioFrame = "dataparser_transforms.json";

// Errors: as JsonFile::Read; kBadFile where transform is no rotation with a translation or scale is not positive.
Result<Similarity> ReadNerfstudioFrame(const std::filesystem::path& file);

// From the world of the original data to that of a transforms.json's matrices: applied_transform; without one, where
// colmap/sparse/0 is in `folder`, what nerfstudio then takes for it; else none. applied_scale is of nerfstudio's scale.
Result<Similarity> AppliedByNerfstudio(const JsonValue& transforms, const std::filesystem::path& folder);

// Moves the cameras of a file to the frame that `file` says, and tells so. `applied`: AppliedByNerfstudio, or nothing
// for cameras in the world of the original data. kBadFile when a camera is not finite then.
Status MoveToNerfstudioFrame(const std::filesystem::path& file, const Similarity& applied, CameraSet& set);

// The file or folder with cameras that the run in `folder` was trained with, by its config.yml. Paths there are
// relative to where nerfstudio was started: they are looked for from each folder above the run on, nearest first, then
// from the current one. Errors: kNotFound.
Result<std::filesystem::path> DataOfNerfstudioRun(const std::filesystem::path& folder);

}  // namespace anchorsplat

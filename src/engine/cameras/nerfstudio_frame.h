#pragma once

#include <filesystem>
#include <optional>

#include "core/camera.h"
#include "core/result.h"
#include "io/json_file.h"

namespace anchorsplat {

// nerfstudio rotates, centres and scales cameras before training and exports splats in that frame. The transform is in
// dataparser_transforms.json of a run (outputs/NAME/METHOD/DATE): p ↦ scale · transform · p from the world of the
// original data, that of the COLMAP model. A transforms.json may itself differ from that world by its applied_transform
// and applied_scale.
inline constexpr const char* kNerfstudioFrame = "dataparser_transforms.json";

// Errors: those of JsonFile::Read; kBadFile: transform is not a rotation with a translation, or scale is not positive.
Result<Similarity> ReadNerfstudioFrame(const std::filesystem::path& file);

// Transform from the world of the original data to that of a transforms.json: applied_transform; without one,
// nerfstudio's default if colmap/sparse/0 exists in `folder`, else the identity. applied_scale is already in
// nerfstudio's scale.
Result<Similarity> AppliedByNerfstudio(const JsonValue& transforms, const std::filesystem::path& folder);

// Moves cameras into the frame in `file`, with a message. `applied`: from AppliedByNerfstudio, or the identity for
// cameras in the world of the original data. kBadFile: a camera becomes non-finite.
Status MoveToNerfstudioFrame(const std::filesystem::path& file, const Similarity& applied, CameraSet& set);

// Path of the cameras that the run in `folder` was trained with, from its config.yml. Relative paths start where
// nerfstudio was run, so they are tried from each folder above the run, nearest first, then from the current one.
// Errors: kNotFound.
Result<std::filesystem::path> DataOfNerfstudioRun(const std::filesystem::path& folder);

}  // namespace anchorsplat

#pragma once

#include <filesystem>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "dataset/object_builder.h"

namespace anchorsplat {

// Derived objects: their splat is another object's, processed further (ObjectSettings::after).

// Fills `folder` with the views of DATASET/JOB.base (all files but record and splats) and returns the base's record.
// Uses hard links if the file system supports them, else copies: files of a data set are replaced, never modified.
// Errors: kNotFound: no such base; kBadArgument: it was made with other settings than the job's; kIo.
Result<ObjectRecord> TakeViewsOfBase(const ObjectJob& job, const std::filesystem::path& dataset,
                                     const std::filesystem::path& folder);

// Processes the base's splat as job.settings.after says: writes it in a format to `folder` and reads it back (losing
// what the format cannot store, in some render mode and comments), or has `program` (anchorsplat) enhance it with the
// low views' cameras. Errors: those of the format; the program's error message (kIo); kInterrupted.
Result<GaussianCloud> PassSplat(const ObjectJob& job, const ObjectRecord& base, const std::filesystem::path& dataset,
                                const std::filesystem::path& folder, const std::filesystem::path& program);

}  // namespace anchorsplat

#pragma once

#include <filesystem>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "dataset/object_builder.h"

namespace anchorsplat {

// Objects whose splat is another object's, passed through something (ObjectSettings::after).

// The record of DATASET/JOB.base and `folder` filled with its views: all of its files but the record and the splats,
// as hard links, which cost no space, where the file system has them, else as copies. Nothing writes into the files of
// a data set; they are replaced.
// Errors: kNotFound: the base is not there; kBadArgument: it was made by other settings than the job's; kIo.
Result<ObjectRecord> TakeViewsOfBase(const ObjectJob& job, const std::filesystem::path& dataset,
                                     const std::filesystem::path& folder);

// The base's splat after job.settings.after: written to a file of that format in `folder` and read back (what its
// format has no place for is lost, as render mode and comments are in some), or as `program`, which is anchorsplat's,
// enhances it with the cameras of the low views.
// Errors: those of the format; of the program, its last words (kIo); kInterrupted.
Result<GaussianCloud> PassSplat(const ObjectJob& job, const ObjectRecord& base, const std::filesystem::path& dataset,
                                const std::filesystem::path& folder, const std::filesystem::path& program);

}  // namespace anchorsplat

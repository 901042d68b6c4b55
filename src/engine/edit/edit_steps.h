#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "core/result.h"
#include "edit/edit_files.h"

namespace anchorsplat {

// Shared by both implementations of EditFiles.

// Applies each input's actions, then those on all, then what ConvertOptions request. `splats`: as read. Errors: those
// of ApplyActions; kBadArgument: nothing is left.
Result<std::vector<EditStep>> ApplyJob(const EditJob& job, std::span<EditedSplat> splats);

// Output rows at which the kept rows of each block of kRowsPerBlock start, and the final end, if the splat starts at
// output row `begin`.
std::vector<int64_t> PlacesOfBlocks(const EditedSplat& splat, int64_t begin);

// Drops comments that refer to the splat's former position. Call after all actions.
void DropPlaces(std::span<EditedSplat> splats);

// Warns how many Gaussians of the result no renderer draws.
void WarnOfUndrawn(const std::filesystem::path& output, int64_t undrawn, int64_t gaussians);

// Seconds since an arbitrary time.
double SecondsNow();

}  // namespace anchorsplat

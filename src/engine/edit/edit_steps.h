#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "core/result.h"
#include "edit/edit_files.h"

namespace anchorsplat {

// What both ways of EditFiles do alike.

// Each input's actions on it, then those on all, with what ConvertOptions ask for behind them. `splats` are as their
// files have them. Errors: those of ApplyActions; kBadArgument where nothing is left.
Result<std::vector<EditStep>> ApplyJob(const EditJob& job, std::span<EditedSplat> splats);

// Where in a result whose row `begin` is the splat's first one the rows that are kept begin, of each kRowsPerBlock rows
// of the splat; then where they end.
std::vector<int64_t> PlacesOfBlocks(const EditedSplat& splat, int64_t begin);

// Drops comments that hold only where a splat was before. Called once all actions are applied.
void DropPlaces(std::span<EditedSplat> splats);

// Says how many Gaussians of the result nobody draws.
void WarnOfUndrawn(const std::filesystem::path& output, int64_t undrawn, int64_t gaussians);

// Seconds from some time on.
double SecondsNow();

}  // namespace anchorsplat

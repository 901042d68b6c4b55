#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/render_mode.h"
#include "edit/edit_plan.h"
#include "formats/extra_properties.h"

namespace anchorsplat {

// Metadata of merged splats. Losses are warned about.

// Comments of all, each once. The first splat that states up decides it; training backgrounds count only if all agree.
// Marks (core/splat_comments.h) that not all have become those of a part.
std::vector<std::string> MergedComments(std::span<const EditedSplat> splats);

// The common render mode; unset if they differ.
std::optional<RenderMode> MergedMode(std::span<const std::optional<RenderMode>> modes);

// Properties (without rows) that all have with the same type, in the first one's order; normals if any has them. Those
// left out go to `not_kept`.
ExtraProperties MergedProperties(std::span<const ExtraProperties* const> extras);

// Appends `rows` [first, last) of a splat to `to`, which has a subset of its properties; missing normals become zero.
// `gaussians`: current size of `to`.
void AppendExtras(const ExtraProperties& rows, int64_t first, int64_t last, int64_t gaussians, bool has_normals,
                  ExtraProperties& to);

}  // namespace anchorsplat

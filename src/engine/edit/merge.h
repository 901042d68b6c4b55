#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/render_mode.h"
#include "edit/edit_plan.h"
#include "formats/extra_properties.h"

namespace anchorsplat {

// What several splats that become one say together. All of it is said in warnings where something is lost.

// Comments of all, each once. Where up is, is what the first one says that says it; what they were trained over counts
// where all agree. Marks (core/splat_comments.h) that not all have become those of a part.
std::vector<std::string> MergedComments(std::span<const EditedSplat> splats);

// That of all; nothing where they differ.
std::optional<RenderMode> MergedMode(std::span<const std::optional<RenderMode>> modes);

// Without rows: the properties, in the order of the first one, that all have of the same type; normals where any has.
// What is left out is named in `not_kept`.
ExtraProperties MergedProperties(std::span<const ExtraProperties* const> extras);

// `rows` [first, last) of a splat behind those of `to`, whose properties are some of theirs: normals that are missing
// are zero. `gaussians`: how many `to` has.
void AppendExtras(const ExtraProperties& rows, int64_t first, int64_t last, int64_t gaussians, bool has_normals,
                  ExtraProperties& to);

}  // namespace anchorsplat

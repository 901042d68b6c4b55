#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/camera.h"
#include "core/cloud_view.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// How a splat is shown everywhere but in fits and trainings: in the mode that its file says (classic where it says
// none), from kNear or, where that is nearer, kNearShare of the distance to it on, however far. So a scene looks the
// same in metres, in kilometres and in the unit that a reconstruction happened to have.
RenderOptions OptionsFor(const CloudView& cloud);

// The near plane of a picture: `options.near_plane` or, where there is a subject and that is nearer, kNearShare of the
// distance to its middle, which counts as no less than its radius. World units along z, positive.
float NearPlane(const RenderOptions& options, const Camera& camera);

// A sentence where a picture that shows `drawn` Gaussians (RenderStatistics::visible) has nothing in it, or where fewer
// than one of a thousand Gaussians lie between its planes: camera and splat do not belong together, or have different
// units. It names the view, says where the Gaussians are, and what to do. Empty when all is well. Without `drawn` only
// the planes are looked at.
std::string NothingToSee(const CloudView& cloud, const Camera& camera, const RenderOptions& options,
                         std::optional<int64_t> drawn);

}  // namespace anchorsplat

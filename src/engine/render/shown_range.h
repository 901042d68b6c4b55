#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/camera.h"
#include "core/cloud_view.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Options for displaying a splat, everywhere except fits and training: the mode stated by its file (default: classic),
// from kNear or, if nearer, kNearShare of the distance to the splat, to infinity. So a scene looks the same in metres,
// kilometres, or the arbitrary unit of a reconstruction.
RenderOptions DisplayOptions(const CloudView& cloud);

// Near plane of a picture: `options.near_plane` or, if there is a subject and that is nearer, kNearShare of the
// distance to its centre, taken as at least its radius. World units along z, positive.
float NearPlane(const RenderOptions& options, const Camera& camera);

// Explains an empty picture: a message if a picture with `drawn` Gaussians (RenderStatistics::visible) shows nothing,
// or if fewer than 1 of 1,000 Gaussians lie between its planes, because camera and splat do not match or have different
// units. It names the view, where the Gaussians are, and what to do. Empty if all is well. Without `drawn`, only the
// planes are checked.
std::string EmptyPictureReason(const CloudView& cloud, const Camera& camera, const RenderOptions& options,
                               std::optional<int64_t> drawn);

}  // namespace anchorsplat

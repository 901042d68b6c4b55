#pragma once

#include <filesystem>

#include "core/camera.h"
#include "core/result.h"
#include "io/write_options.h"

namespace anchorsplat {

// Reads cameras from a NeRF/nerfstudio transforms.json, an INRIA cameras.json, LLFF's poses_bounds.npy, Metashape's
// XML, OpenSfM's reconstruction.json, Bundler's bundle.out, or a COLMAP sparse model (any of its files, its folder, or
// a project folder: of several models the one with most images, see FindColmapModels in cameras/colmap_model.h; a
// message lists the others). A folder may also contain one of the other files (OpenSfM's also in opensfm, Bundler's in
// bundle), poses_bounds.npy only if there is nothing else. Order as in the file; names may repeat.
//
// Images are searched as described in cameras/picture_search.h. `missing`, if given, becomes the first path at which an
// image was not found, and ambiguous images are kBadArgument. Without it, such cameras just have no image.
//
// A dataparser_transforms.json of nerfstudio, beside a transforms.json or COLMAP model, or given by its path or run
// folder (whose config.yml names the cameras), moves the cameras into nerfstudio's training frame; a message and
// `moved` say so.
//
// `intrinsics` never include a lens: for distorted images they are those of the undistorted view
// (cameras/undistortion.h), which ReadPhotograph produces (cameras/photograph.h).
//
// Errors: kNotFound; kIo; kBadFile with file, line or byte or JSON path (an unsupported lens is named; files of other
// programs come with what to export instead); kBadArgument: a folder with several sets of cameras, which are listed.
Result<CameraSet> ReadCameras(const std::filesystem::path& path, std::filesystem::path* missing = nullptr);

// Writes a transforms.json in nerfstudio's form (fl_x, fl_y, cx, cy, w, h; OpenGL camera-to-world matrices) with our
// `background`. Intrinsics are those of the first camera; other cameras repeat only differences. `file_path` is the
// camera's name with the image's extension (.png without an image). ReadCameras gives back the same numbers, up to the
// last bits of translations. All or nothing.
//
// Errors: kExists, kNotFound, kIo; kBadArgument: no cameras, a name that is not UTF-8, numbers that are not finite.
Status WriteTransforms(const std::filesystem::path& path, const CameraSet& cameras, const WriteOptions& options = {});

}  // namespace anchorsplat

#pragma once

#include <filesystem>

#include "core/camera.h"
#include "core/result.h"
#include "io/write_options.h"

namespace anchorsplat {

// Reads cameras from a NeRF/nerfstudio transforms.json, an INRIA cameras.json, LLFF's poses_bounds.npy, Metashape's
// XML, OpenSfM's reconstruction.json, Bundler's bundle.out, or a COLMAP sparse model (any of its files, its folder, or
// a project folder that has it: of several models the one with most pictures, FindColmapModels in
// cameras/colmap_model.h; a message names the others). A folder may also hold one of the others (OpenSfM's also in
// opensfm, Bundler's in bundle), poses_bounds.npy only where there is nothing else. Order as in the file; names may
// repeat. Pictures are found as cameras/picture_search.h says. Who needs them gives `missing`, which becomes the first
// path at which one was looked for in vain; then two that are as likely are kBadArgument, and else that camera has
// none.
//
// Where nerfstudio's dataparser_transforms.json lies beside a transforms.json or a COLMAP model, or is named itself, or
// its folder (that of a run, whose config.yml says where the cameras are), they are moved into the frame that
// nerfstudio trained in; a message says so, and `moved`.
//
// A camera's `intrinsics` have no lens: where the file says there was one they are those of the pinhole that its
// pictures are undone to (cameras/undistortion.h), and ReadPhotograph makes such a picture (cameras/photograph.h).
//
// Errors: kNotFound; kIo; kBadFile with file, line or byte or JSON path (a lens that is not known here is refused with
// the model's name; files of other programs with what to export instead); kBadArgument for a folder with several sets
// of cameras, which are listed.
Result<CameraSet> ReadCameras(const std::filesystem::path& path, std::filesystem::path* missing = nullptr);

// Writes a transforms.json in nerfstudio's form (fl_x, fl_y, cx, cy, w, h; OpenGL camera-to-world matrices) with our
// `background`. Intrinsics are those of the first camera; other cameras repeat only what differs. `file_path` is the
// camera's name with its picture's extension (.png where it has no picture). ReadCameras gives back the same numbers,
// up to the last bits of the translations. Whole or not at all.
//
// Errors: kExists, kNotFound, kIo; kBadArgument: no cameras, a name that is not UTF-8, numbers that are not finite.
Status WriteTransforms(const std::filesystem::path& path, const CameraSet& cameras, const WriteOptions& options = {});

}  // namespace anchorsplat

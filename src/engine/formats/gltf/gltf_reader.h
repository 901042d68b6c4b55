#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads the splats of a glTF 2.0 file, binary (.glb) or JSON (.gltf) with buffers beside it or inside as base64: all
// point primitives with KHR_gaussian_splatting that the scene's nodes show, one after the other, in the axes that glTF
// gives them (LUF, which become RDF), moved, turned, mirrored and scaled as their nodes say, harmonics with them.
// Attributes are floats or, where the extension allows it, normalised integers. SCALE holds lengths and OPACITY 0 to 1;
// files that hold logarithms and logits instead are known by their values (gltf_meanings.h), which a warning says.
// Colours of the space lin_rec709_display become sRGB (linear_color.h), with a warning; so are splats that no node of
// the scene shows, and animations.
//
// Errors (kBadFile): no glTF, no such primitive, a kernel, projection or colour space that is not known, compressed
// attributes, a required extension that is not known, attributes missing or of a type, count or value that is not
// allowed, accessors that lead out of their view, buffer or file, nodes in a circle, a length of a GLB that is not the
// file's, nodes that stretch a splat, names that lead to another folder, more than `limits.max_gaussians`.
Result<GaussianCloud> ReadGltf(const InputFile& file, const ReadLimits& limits = {});

// Bytes of the file and of those beside it that its buffers are.
uint64_t GltfSize(const InputFile& file);

// Who wrote it and what the extension says about each kind of primitive. Errors as ReadGltf.
Result<FormatFacts> DescribeGltf(const InputFile& file);

}  // namespace anchorsplat

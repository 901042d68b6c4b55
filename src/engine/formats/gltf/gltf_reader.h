#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads the splats of a glTF 2.0 file, binary (.glb) or JSON (.gltf) with buffers beside it or inline as base64: all
// point primitives with KHR_gaussian_splatting shown by the scene, concatenated. Axes are glTF's (LUF, converted to
// RDF); nodes move, rotate, mirror and scale splats, including harmonics. Attributes are floats or, where the extension
// allows, normalised integers. SCALE has lengths and OPACITY 0–1; logarithms and logits are detected (gltf_meanings.h)
// with a warning. Colours in lin_rec709_display are converted to sRGB (linear_color.h) with a warning. Splats outside
// the scene, and animations, are ignored with a warning.
//
// Errors (kBadFile): not glTF; no such primitive; an unknown kernel, projection or colour space; compressed attributes;
// an unknown required extension; attributes missing or with an invalid type, count or value; accessors beyond their
// view, buffer or file; cyclic nodes; a GLB length other than the file's; nodes with anisotropic scale; names in
// another folder; more than `limits.max_gaussians`.
Result<GaussianCloud> ReadGltf(const InputFile& file, const ReadLimits& limits = {});

// Bytes of the file and its buffer files.
uint64_t GltfSize(const InputFile& file);

// Generator, and properties of each kind of primitive. Errors: those of ReadGltf.
Result<FormatFacts> DescribeGltf(const InputFile& file);

}  // namespace anchorsplat

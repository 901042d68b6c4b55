#pragma once

#include <cstdint>
#include <string_view>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// Whether a file that starts with `head` was written by torch.save: a zip archive with a data.pkl, or the older
// pickles.
bool IsTorchCheckpoint(std::string_view head);

// Reads the Gaussians of a checkpoint of gsplat's trainer (examples/simple_trainer.py, ckpt_{step}_rank{r}.pt): a
// dictionary "splats" with means [N,3], scales [N,3] (logarithms), quats [N,4] (wxyz, any norm), opacities [N]
// (logits), sh0 [N,1,3] and shN [N,(degree+1)²−1,3], which is our stored space; other members are ignored. In
// distributed training each file has a part of the Gaussians: all files that differ only in {r} are read together, in
// order, with a message. Double-precision means are world coordinates (core/world_origin.h).
//
// Also reads nerfstudio's splatfacto (step-000029999.ckpt): the same under "pipeline" with the names
// _model.gauss_params.means, scales, quats, opacities [N,1], features_dc [N,3], features_rest. At SH degree 0
// features_dc are logits of colours and are converted to f_dc. Means stay in the space of nerfstudio's data parser.
//
// Also reads INRIA's trainer (chkpnt30000.pth): a tuple (SH degree, means, features_dc, features_rest, scales, quats,
// opacities, …), alone or paired with the iteration. Two scales instead of three (2DGS) are surfels.
//
// The file is read, not mapped: values are copied once, and it may come through a pipe. Errors (kBadFile): those of
// TensorFile; a tensor missing, of another shape or not floating-point; an SH degree above 3; no Gaussians, or more
// than limits.max_gaussians; a distributed splat with missing parts, or with parts of another degree or step.
Result<GaussianCloud> ReadGsplatCheckpoint(const InputFile& file, const ReadLimits& limits = {});

// Bytes of the file and its sibling parts, which are recorded as inputs (input_record.h).
uint64_t GsplatCheckpointSize(const InputFile& file);

// Whether it contains Gaussians rather than a network.
bool HoldsGaussians(const TensorFile& file);

}  // namespace anchorsplat

#pragma once

#include <cstdint>
#include <string_view>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// Whether a file that begins with `head` is what torch.save writes: a zip archive with a data.pkl, or the older
// pickles.
bool IsTorchCheckpoint(std::string_view head);

// Reads the Gaussians of a checkpoint of gsplat's trainer (examples/simple_trainer.py, ckpt_{step}_rank{r}.pt): a
// dictionary "splats" with means [N,3], scales [N,3] (logarithms), quats [N,4] (wxyz, any norm), opacities [N]
// (logits), sh0 [N,1,3] and shN [N,(degree+1)²−1,3], which is our stored space; other members are left alone. Of a run
// on several processors each file holds its own part of the Gaussians: all those beside it that differ in {r} only are
// read along, in their order, which a message says. Means in double precision are world coordinates
// (core/world_origin.h).
//
// Or those of a checkpoint of nerfstudio's splatfacto (step-000029999.ckpt): the same under "pipeline" with the names
// _model.gauss_params.means, scales, quats, opacities [N,1], features_dc [N,3], features_rest; of SH degree 0 its
// features_dc are logits of colours and become f_dc. Centres stay in the space that nerfstudio's data parser made.
//
// Or those of INRIA's trainer (chkpnt30000.pth): a tuple of the tuple (SH degree, means, features_dc, features_rest,
// scales, quats, opacities, …) and the iteration, or the former alone. Two scales instead of three (2DGS) are surfels.
//
// The file is read into memory, not mapped: its values are copied once, and splats may come through a pipe.
// Errors (kBadFile): as for TensorFile; a tensor missing, of another shape, or not of floating-point numbers; an SH
// degree above 3; no Gaussians, or more than limits.max_gaussians; a part of a splat whose other parts are not all
// there, or of another degree or step.
Result<GaussianCloud> ReadGsplatCheckpoint(const InputFile& file, const ReadLimits& limits = {});

// Bytes of the file and of the other parts beside it, which are put down as inputs (input_record.h).
uint64_t GsplatCheckpointSize(const InputFile& file);

// Whether it is one of these, and no network.
bool HoldsGaussians(const TensorFile& file);

}  // namespace anchorsplat

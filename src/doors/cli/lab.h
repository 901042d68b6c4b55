#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "cli/finding.h"
#include "cli/verb.h"
#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// What verbs take of the lab (src/lab). with_lab/ has it; without_lab/ is what a program has that was built without:
// its own verbs (AddEval, AddViews, AddDataset, AddTrain, AddBench) say so there, too.

// Whether `info` should look at this as a mesh or a furniture library: by its name, and by content where splats have
// files of the same ending (PLY with faces; glTF without Gaussians). Nothing does without the lab.
bool LooksLikeMesh(const std::string& address);

// `info` of a mesh, or of every object of a library.
Status RunMeshInfo(const std::string& address, const SharedFlags& shared);

inline constexpr const char* kLpipsIfThere = "if-there";
// --lpips NET and --lpips-weights DIR. NET may be "if-there": alex, and none where it is missing.
void AddLpipsFlags(CLI::App& verb, std::string& net, std::string& folder);

// Of a picture from the truth. None: not asked for (`net` empty), or missing and asked for only if there, which is a
// warning. An empty `folder` is LpipsFolder(). Errors: kNotFound where it is missing; weights that are there and
// broken.
using PictureDistance = std::function<Result<double>(const Image& picture, const Image& truth)>;
Result<PictureDistance> OpenLpipsDistance(const std::string& net, const std::string& folder);

// What `doctor` says of training, LPIPS and its weights.
std::vector<Finding> LabFindings();

}  // namespace anchorsplat

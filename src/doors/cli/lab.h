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

// What verbs use of the lab (src/lab), implemented in with_lab/. A program built without the lab has without_lab/,
// where the lab's verbs (AddEval, AddViews, AddDataset, AddTrain, AddBench) report that they are missing.

// Whether `info` treats the file as a mesh or furniture library: by name, and by content if splats use the same
// extension (PLY with faces, glTF without Gaussians). Never without the lab.
bool LooksLikeMesh(const std::string& address);

// `info` of a mesh, or of every object of a library.
Status RunMeshInfo(const std::string& address, const SharedFlags& shared);

inline constexpr const char* kLpipsIfThere = "if-there";
// --lpips NET and --lpips-weights DIR. NET may be "if-there": alex if available.
void AddLpipsFlags(CLI::App& verb, std::string& net, std::string& folder);

// LPIPS of a picture against the truth. Null if `net` is empty, or, with a warning, if "if-there" and missing. An empty
// `folder` means LpipsFolder(). Errors: kNotFound if missing; broken weights.
using PictureDistance = std::function<Result<double>(const Image& picture, const Image& truth)>;
Result<PictureDistance> OpenLpipsDistance(const std::string& net, const std::string& folder);

// Findings of `doctor` on training, LPIPS and its weights.
std::vector<Finding> LabFindings();

}  // namespace anchorsplat

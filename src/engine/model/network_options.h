#pragma once

#include <vector>

#include "enhance/enhance.h"

namespace anchorsplat {

// Whether `model` certainly names a published network; unreadable files are reported on loading.
bool IsPublished(const ModelSettings& model);

// Every option of ModelSettings that users can set …
const std::vector<MethodOption>& NetworkOptions();
// … and those for running a published network as its script does.
const std::vector<MethodOption>& PublishedScriptOptions();

}  // namespace anchorsplat

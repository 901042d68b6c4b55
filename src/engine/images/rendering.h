#pragma once

#include <filesystem>
#include <string>

#include "core/image.h"
#include "core/result.h"
#include "io/write_options.h"

namespace anchorsplat {

// WritePng (images/image_io.h) of what was rendered, which the file says (its text "Software").
Status WriteRendering(const std::filesystem::path& path, const Image& image, const WriteOptions& options = {},
                      const std::string& comment = {});

// Whether a file is such a rendering, which is looked for in its first bytes. That alone does not make it an input
// (io/input_record.h).
bool IsOwnRendering(const std::filesystem::path& path);

}  // namespace anchorsplat

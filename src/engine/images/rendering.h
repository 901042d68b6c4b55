#pragma once

#include <filesystem>
#include <string>

#include "core/image.h"
#include "core/result.h"
#include "io/write_options.h"

namespace anchorsplat {

// WritePng (images/image_io.h) with a mark that the image was rendered (text "Software").
Status WriteRendering(const std::filesystem::path& path, const Image& image, const WriteOptions& options = {},
                      const std::string& comment = {});

// Whether a file begins with that mark. Checking does not make it an input (io/input_record.h).
bool IsOwnRendering(const std::filesystem::path& path);

}  // namespace anchorsplat

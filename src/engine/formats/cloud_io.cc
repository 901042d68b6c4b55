#include "formats/cloud_io.h"

#include <new>
#include <string>

#include "core/log.h"
#include "core/text.h"
#include "formats/extra_properties.h"
#include "formats/hidden_rows.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "formats/write_losses.h"

namespace anchorsplat {

namespace {

// "PLY (.ply), SPZ (.spz)".
std::string WrittenFormats() {
  std::string list;
  for (const SplatFormat& format : Formats()) {
    if (format.write == nullptr) continue;
    if (!list.empty()) list += ", ";
    list += Cat(format.name, " (", format.extensions.front(), ")");
  }
  return list;
}

Error OutOfMemory(const std::filesystem::path& path) {
  return {ErrorCode::kIo, Cat(path.string(), ": not enough memory for its Gaussians")};
}

}  // namespace

Result<GaussianCloud> ReadCloud(const std::filesystem::path& path, const ReadLimits& limits) try {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Open(path));
  return file.Read(limits);
} catch (const std::bad_alloc&) {
  return OutOfMemory(path);
}

Status WriteCloud(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  return WriteCloud(path, cloud, options, ExtraProperties{});
}

Status WriteCloud(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options,
                  const ExtraProperties& extras) try {
  const SplatFormat* format = FormatOfExtension(path);
  if (format == nullptr || format->write == nullptr) {
    const std::string what = format == nullptr
                                 ? Cat("has no splat extension")
                                 : Cat("is ", format->article, " ", format->name, " file, which cannot be written");
    return Error{ErrorCode::kBadArgument, Cat(path.string(), ": ", what, "; supported: ", WrittenFormats())};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  const HiddenRows hidden = HideRows(*format, cloud);
  const CloudView written = hidden.any() ? CloudView(hidden.written) : cloud;
  const bool keeps = format->write_with_extras != nullptr;
  ANCHORSPLAT_RETURN_IF_ERROR(keeps ? format->write_with_extras(path, written, options, extras)
                                    : format->write(path, written, options));
  WarnOfHiddenRows(path, *format, hidden);
  for (const std::string& loss : WriteLosses(*format, written)) LogWarning(Cat(path.string(), ": ", loss));
  if (const std::string lost = extras.lost(keeps); !lost.empty()) {
    LogWarning(Cat(path.string(), ": extra properties of the input dropped: ", lost));
  }
  return {};
} catch (const std::bad_alloc&) {
  return OutOfMemory(path);
}

}  // namespace anchorsplat

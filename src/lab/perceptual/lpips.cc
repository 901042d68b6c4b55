#include "perceptual/lpips.h"

#include <dlfcn.h>

#include <array>
#include <cmath>
#include <utility>

#include "core/companion.h"
#include "core/file_system.h"
#include "core/parallel.h"
#include "core/text.h"
#include "perceptual/lpips_plugin.h"

namespace anchorsplat {

namespace fs = std::filesystem;

namespace {

Result<const LpipsPlugin*> LoadPlugin(const fs::path& path) {
  if (!Exists(path)) {
    return Error{ErrorCode::kNotFound,
                 "LPIPS missing: this program was built without LibTorch (`anchorsplat doctor` says how to get it)"};
  }
  // Never closed, because LibTorch cannot be unloaded.
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return Error{ErrorCode::kBadFile, Cat("LPIPS missing: ", dlerror())};
  using Entry = const LpipsPlugin* (*)();
  const Entry entry = reinterpret_cast<Entry>(dlsym(library, kLpipsPluginSymbol));
  const LpipsPlugin* plugin = entry == nullptr ? nullptr : entry();
  if (plugin == nullptr || plugin->version != kLpipsPluginVersion) {
    return Error{ErrorCode::kBadFile, Cat("LPIPS missing: ", path.string(), " belongs to another build; make build")};
  }
  return plugin;
}

}  // namespace

fs::path Lpips::PluginPath() { return CompanionFile("anchorsplat-lpips.so"); }

Status Lpips::CheckPlugin(const fs::path& path) {
  const auto plugin = LoadPlugin(path);
  return plugin.ok() ? Status() : Status(plugin.error());
}

Result<Lpips> Lpips::Open(const LpipsWeights& weights, const fs::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const LpipsPlugin* plugin, LoadPlugin(path));
  std::vector<const float*> tensors;
  std::vector<int64_t> sizes;
  for (const Buffer<float>& tensor : weights.tensors) {
    tensors.push_back(tensor.data());
    sizes.push_back(static_cast<int64_t>(tensor.size()));
  }
  std::array<char, 256> error{};
  void* network = plugin->open(static_cast<int>(weights.net), tensors.data(), sizes.data(), tensors.size(),
                               error.data(), error.size());
  if (network == nullptr) return Error{ErrorCode::kBadArgument, Cat("LPIPS: ", error.data())};
  return Lpips(weights.net, plugin, std::shared_ptr<void>(network, plugin->close));
}

Result<double> Lpips::Distance(const Image& a, const Image& b) const {
  if (a.width != b.width || a.height != b.height || a.channels < 3 || b.channels < 3) {
    return Error{ErrorCode::kBadArgument,
                 Cat("LPIPS compares colour pictures of one size, not ", a.width, " x ", a.height, " x ", a.channels,
                     " and ", b.width, " x ", b.height, " x ", b.channels)};
  }
  const int smallest = SmallestLpipsSide(net_);
  if (a.width < smallest || a.height < smallest) {
    return Error{ErrorCode::kBadArgument, Cat("pictures of ", a.width, " x ", a.height, " are too small for LPIPS (",
                                              LpipsNetName(net_), " needs ", smallest, " pixels a side)")};
  }
  std::array<char, 256> error{};
  const double distance = plugin_->distance(network_.get(), a.pixels.data(), b.pixels.data(), a.height, a.width,
                                            ThreadCount(), error.data(), error.size());
  if (error[0] != 0) return Error{ErrorCode::kIo, Cat("LPIPS: ", error.data())};
  return distance;
}

}  // namespace anchorsplat

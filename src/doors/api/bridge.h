#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/picture.h>
#include <anchorsplat/render.h>
#include <anchorsplat/run.h>
#include <anchorsplat/splat.h>

#include <exception>
#include <new>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "core/camera.h"
#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "core/run_context.h"
#include "io/input_record.h"

// Conversions between the public types (include/anchorsplat/) and the engine's.
namespace anchorsplat {

struct Splat::Owned {
  GaussianCloud cloud;
};

struct SplatAccess {
  static Splat Make(GaussianCloud cloud);
  static GaussianCloud Take(Splat splat);
};

Failure ToFailure(const Error& error);
CloudView ToCloud(const SplatView& view);
SplatView ToView(const CloudView& cloud);
std::optional<RenderMode> ToMode(std::optional<Rasterization> rasterization);
std::optional<Rasterization> ToRasterization(std::optional<RenderMode> mode);
Camera ToCamera(const PinholeCamera& camera);
PinholeCamera ToPinhole(const Camera& camera);
// kBadArgument: the number of values does not match the shape.
Result<Image> ToImage(const Picture& picture);
Picture ToPicture(const Image& image);
// kBadArgument: an unknown RunSettings::device.
Result<RunContext> ToContext(const RunSettings& run);
// Opens the device of RunSettings::device. kNotFound: unavailable.
Status OpenDevice();

// Runs `call` as a separate run and converts its result to public types; catches all exceptions.
template <typename T, typename Call>
Expected<T> InRun(const RunSettings& run, Call&& call) try {
  auto context = ToContext(run);
  if (!context.ok()) return ToFailure(context.error());
  const RunScope scope(*std::move(context));
  if (const Status device = OpenDevice(); !device.ok()) return ToFailure(device.error());
  const InputRecord record;  // the call never overwrites what it reads
  auto result = call();
  if (!result.ok()) return ToFailure(result.error());
  if constexpr (std::is_void_v<T>) {
    return {};
  } else {
    return *std::move(result);
  }
} catch (const RunAbandoned&) {
  return Failure{FailureKind::kStopped, "stopped"};
} catch (const std::bad_alloc&) {
  return Failure{FailureKind::kIo, "there is not enough memory"};
} catch (const std::exception& error) {
  return Failure{FailureKind::kIo, std::string("unexpected: ") + error.what()};
}

}  // namespace anchorsplat

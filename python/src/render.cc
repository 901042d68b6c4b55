#include <nanobind/stl/string.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "bindings.h"
#include "columns.h"
#include "core/log.h"
#include "core/run_context.h"
#include "core/text.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"
#include "request/views.h"
#include "request/words.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

struct Pictures {
  size_t views = 0, height = 0, width = 0, channels = 0;
  Buffer<float> values;  // [V,H,W,C]
};

Result<CameraSet> OfOneSize(CameraSet set) {
  for (const Camera& camera : set.cameras) {
    const Pinhole &first = set.cameras.front().intrinsics, &k = camera.intrinsics;
    if (k.width == first.width && k.height == first.height) continue;
    return Error{ErrorCode::kBadArgument,
                 Cat("cameras ", set.cameras.front().name, " (", first.width, "x", first.height, ") and ", camera.name,
                     " (", k.width, "x", k.height,
                     ") have different sizes and cannot be one array: render those of one size at a time, or say "
                     "--size")};
  }
  return set;
}

Result<Pictures> Draw(const CloudView& cloud, const ViewFlags& flags, bool transparent, const CameraSet* given) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet made, MakeViews(flags, cloud, given));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet cameras, OfOneSize(std::move(made)));
  ANCHORSPLAT_ASSIGN_OR_RETURN(RenderOptions options, MakeRenderOptions(flags, cloud, cameras));
  if (transparent) options.background = {0, 0, 0};
  Pictures out;
  out.channels = transparent ? 4 : 3;
  out.views = cameras.cameras.size();
  if (out.views == 0) return out;
  const Pinhole& size = cameras.cameras.front().intrinsics;
  out.width = static_cast<size_t>(size.width);
  out.height = static_cast<size_t>(size.height);
  out.values.resize(out.views * out.height * out.width * out.channels);
  Rasterizer rasterizer;
  RenderOutput render;
  std::string empty;
  int64_t empty_views = 0;
  Progress progress("render", static_cast<int64_t>(out.views));
  for (size_t v = 0; v < out.views; ++v) {
    const Camera& camera = cameras.cameras[v];
    LeaveIfAbandoned();
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, camera, options, render));
    const std::string nothing = EmptyPictureReason(cloud, camera, options, rasterizer.statistics().visible);
    if (!nothing.empty() && empty_views++ == 0) empty = nothing;
    const Image picture = transparent ? WithAlpha(render) : std::move(render.color);
    const auto pixels = static_cast<size_t>(picture.plane());
    float* const to = out.values.data() + v * pixels * out.channels;
    for (size_t c = 0; c < out.channels; ++c) {
      const float* const from = picture.channel(static_cast<int>(c));
      for (size_t i = 0; i < pixels; ++i) to[i * out.channels + c] = from[i];
    }
    progress.Advance();
  }
  if (empty_views > 0) {
    LogWarning(Cat(empty, " Check --near and --far",
                   empty_views > 1 ? Cat(" (", empty_views - 1, " more of ", out.views, " views are as empty)") : ""));
  }
  return out;
}

nb::object Render(nb::handle cloud, const nb::list& words, bool transparent, const CameraSet* cameras,
                  const RunArguments& run) {
  const Columns columns(cloud);
  ViewFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  OrThrow(ParseWords(verb, WordsOf(words)));
  Pictures pictures = ResultOf(run, [&] { return Draw(columns.view(), flags, transparent, cameras); });
  return ToArray(std::move(pictures.values), {pictures.views, pictures.height, pictures.width, pictures.channels});
}

}  // namespace

void BindRender(nb::module_& module) {
  module.def("render", &Render, nb::arg("cloud").none(), nb::arg("words"), nb::arg("transparent"),
             nb::arg("cameras").none(), nb::arg("run"));
}

}  // namespace anchorsplat::python

#include "render/rasterizer.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bindings.h"
#include "columns.h"
#include "core/log.h"
#include "core/text.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

using Floats = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;

struct Drawn {
  size_t views = 0, height = 0, width = 0;
  Buffer<float> color;  // [V,H,W,3]
  Buffer<float> alpha;  // [V,H,W,1]
};

// Pictures of a splat and what their gradient needs, a rasterizer per view; the splat is kept, too. Backward may be
// called again.
class DifferentiableViews {
 public:
  DifferentiableViews(nb::object cloud, const CameraSet& cameras, RenderOptions options)
      : cloud_(std::move(cloud)), columns_(cloud_), cameras_(cameras), options_(options) {
    options_.gradient = true;
  }

  Result<Drawn> Forward() {
    ANCHORSPLAT_RETURN_IF_ERROR(Validate(columns_.view()));
    Drawn out;
    out.views = cameras_.cameras.size();
    if (out.views == 0) return Error{ErrorCode::kBadArgument, "there are no cameras to render from"};
    const Pinhole& size = cameras_.cameras.front().intrinsics;
    out.height = static_cast<size_t>(size.height);
    out.width = static_cast<size_t>(size.width);
    const size_t pixels = out.height * out.width;
    out.color.resize(out.views * pixels * 3);
    out.alpha.resize(out.views * pixels);
    rasterizers_ = std::vector<Rasterizer>(out.views);
    RenderOutput render;
    for (size_t v = 0; v < out.views; ++v) {
      const Pinhole& k = cameras_.cameras[v].intrinsics;
      if (k.width != size.width || k.height != size.height) {
        return Error{ErrorCode::kBadArgument, "the cameras have different sizes and cannot be one tensor"};
      }
      ANCHORSPLAT_RETURN_IF_ERROR(rasterizers_[v].Render(columns_.view(), cameras_.cameras[v], options_, render));
      for (size_t c = 0; c < 3; ++c) {
        const float* const from = render.color.channel(static_cast<int>(c));
        float* const to = out.color.data() + v * pixels * 3 + c;
        for (size_t i = 0; i < pixels; ++i) to[3 * i] = from[i];
      }
      std::copy_n(render.alpha.pixels.data(), pixels, out.alpha.data() + v * pixels);
    }
    return out;
  }

  Result<CloudGradient> Backward(const Floats& color, const Floats& alpha) {
    CloudGradient sum, one;
    for (size_t v = 0; v < rasterizers_.size(); ++v) {
      const Pinhole& k = cameras_.cameras[v].intrinsics;
      RenderGradient gradient;
      gradient.color = Image(k.width, k.height, 3);
      gradient.alpha = Image(k.width, k.height, 1);
      gradient.box = {0, 0, k.width, k.height};
      const auto pixels = static_cast<size_t>(gradient.color.plane());
      for (size_t c = 0; c < 3; ++c) {
        const float* const from = color.data() + v * pixels * 3 + c;
        float* const to = gradient.color.channel(static_cast<int>(c));
        for (size_t i = 0; i < pixels; ++i) to[i] = from[3 * i];
      }
      std::copy_n(alpha.data() + v * pixels, pixels, gradient.alpha.pixels.data());
      ANCHORSPLAT_RETURN_IF_ERROR(rasterizers_[v].Backward(columns_.view(), gradient, v == 0 ? sum : one));
      if (v > 0) Add(one, sum);
    }
    return sum;
  }

  size_t count() const { return static_cast<size_t>(columns_.view().size()); }
  size_t coefficients() const { return static_cast<size_t>(columns_.view().coefficients()); }
  size_t views() const { return rasterizers_.size(); }
  size_t pixels() const {
    return cameras_.cameras.empty() ? 0
                                    : static_cast<size_t>(cameras_.cameras.front().intrinsics.width) *
                                          static_cast<size_t>(cameras_.cameras.front().intrinsics.height);
  }

 private:
  static void Add(const Buffer<float>& from, Buffer<float>& to) {
    for (size_t i = 0; i < to.size(); ++i) to[i] += from[i];
  }
  static void Add(const CloudGradient& from, CloudGradient& to) {
    Add(from.means, to.means);
    Add(from.log_scales, to.log_scales);
    Add(from.quats, to.quats);
    Add(from.opacity_logits, to.opacity_logits);
    Add(from.sh, to.sh);
    for (size_t c = 0; c < 3; ++c) to.background[c] += from.background[c];
  }

  nb::object cloud_;
  Columns columns_;
  CameraSet cameras_;
  RenderOptions options_;
  std::vector<Rasterizer> rasterizers_;
};

RenderMode ModeOf(const std::string& word) {
  if (const std::optional<RenderMode> mode = RenderModeNamed(word)) return *mode;
  throw EngineError(
      {ErrorCode::kBadArgument, Cat("--mode: ", Printable(word), " is none of classic, antialiased, mip")});
}

nb::tuple Forward(DifferentiableViews& views, const RunArguments& run) {
  Drawn drawn = ResultOf(run, [&] { return views.Forward(); });
  return nb::make_tuple(ToArray(std::move(drawn.color), {drawn.views, drawn.height, drawn.width, 3}),
                        ToArray(std::move(drawn.alpha), {drawn.views, drawn.height, drawn.width, 1}));
}

nb::tuple Backward(DifferentiableViews& views, const Floats& color, const Floats& alpha, const RunArguments& run) {
  if (color.size() != views.views() * views.pixels() * 3 || alpha.size() != views.views() * views.pixels()) {
    throw EngineError({ErrorCode::kBadArgument, "gradients of another size than the pictures"});
  }
  CloudGradient g = ResultOf(run, [&] { return views.Backward(color, alpha); });
  const size_t n = views.count();
  const auto [red, green, blue] = g.background;
  return nb::make_tuple(ToArray(std::move(g.means), {n, 3}), ToArray(std::move(g.log_scales), {n, 3}),
                        ToArray(std::move(g.quats), {n, 4}), ToArray(std::move(g.opacity_logits), {n}),
                        ToArray(std::move(g.sh), {n, views.coefficients(), 3}), nb::make_tuple(red, green, blue));
}

}  // namespace

void BindRasterizer(nb::module_& module) {
  nb::class_<DifferentiableViews>(module, "DifferentiableViews")
      .def(
          "__init__",
          [](DifferentiableViews* self, nb::object cloud, const CameraSet& cameras, const std::string& mode,
             std::array<float, 3> background, int sh_degree, float near_plane, float far_plane,
             const std::string& profile) {
            RenderOptions options;
            options.mode = ModeOf(mode);
            options.background = background;
            options.sh_degree = sh_degree;
            options.near_plane = near_plane;
            options.far_plane = far_plane;
            options.profile = profile == "gsplat15" ? RasterProfile::kGsplat15 : RasterProfile::kGsplat14;
            new (self) DifferentiableViews(std::move(cloud), cameras, options);
          },
          nb::arg("cloud").none(), nb::arg("cameras"), nb::arg("mode"), nb::arg("background"), nb::arg("sh_degree"),
          nb::arg("near_plane"), nb::arg("far_plane"), nb::arg("profile"))
      .def("forward", &Forward, nb::arg("run"))
      .def("backward", &Backward, nb::arg("color"), nb::arg("alpha"), nb::arg("run"));
}

}  // namespace anchorsplat::python

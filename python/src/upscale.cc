#include <cstdint>
#include <string>
#include <utility>

#include "bindings.h"
#include "columns.h"
#include "core/log.h"
#include "core/run_context.h"
#include "request/upscale_flags.h"
#include "request/words.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

using Floats = nb::ndarray<const float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

struct Enlarged {
  size_t views = 0, height = 0, width = 0, channels = 0;
  Buffer<float> values;  // [V,H,W,C]
};

Result<Enlarged> Enlarge(const Floats& pictures, const UpscaleFlags& flags) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Upscaler network, Upscaler::Read(flags.network));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const EnlargeOptions options, MakeEnlargeOptions(flags, network.info()));
  const auto factor = static_cast<size_t>(options.factor);
  Enlarged out{pictures.shape(0), pictures.shape(1) * factor, pictures.shape(2) * factor, pictures.shape(3), {}};
  Image image(static_cast<int>(pictures.shape(2)), static_cast<int>(pictures.shape(1)), static_cast<int>(out.channels));
  const auto pixels = static_cast<size_t>(image.plane());
  const size_t large_pixels = out.height * out.width;
  Progress progress("upscale", static_cast<int64_t>(out.views));
  for (size_t v = 0; v < out.views; ++v) {
    LeaveIfAbandoned();
    const float* const from = pictures.data() + v * pixels * out.channels;
    for (size_t c = 0; c < out.channels; ++c) {
      for (size_t i = 0; i < pixels; ++i) image.channel(static_cast<int>(c))[i] = from[i * out.channels + c];
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image large, EnlargePicture(network, image, options));
    out.values.resize(out.views * large_pixels * out.channels);
    float* const to = out.values.data() + v * large_pixels * out.channels;
    for (size_t c = 0; c < out.channels; ++c) {
      const float* const channel = large.channel(static_cast<int>(c));
      for (size_t i = 0; i < large_pixels; ++i) to[i * out.channels + c] = channel[i];
    }
    progress.Advance();
  }
  return out;
}

nb::object Upscale(const Floats& pictures, const nb::list& words, const RunArguments& run) {
  UpscaleFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  OrThrow(ParseWords(verb, WordsOf(words)));
  Enlarged out = ResultOf(run, [&] { return Enlarge(pictures, flags); });
  return ToArray(std::move(out.values), {out.views, out.height, out.width, out.channels});
}

}  // namespace

void BindUpscale(nb::module_& module) {
  module.def("upscale", &Upscale, nb::arg("pictures"), nb::arg("words"), nb::arg("run"));
}

}  // namespace anchorsplat::python

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bindings.h"
#include "columns.h"
#include "compare/comparison.h"
#include "core/run_context.h"
#include "metrics/image_metrics.h"
#include "metrics/side_by_side.h"
#include "request/compare_flags.h"
#include "request/device_flags.h"
#include "request/words.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

using Floats = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;

// [V,H,W,C] of a caller that keeps them.
struct PictureArray {
  explicit PictureArray(Floats of) : array(std::move(of)) {
    if (array.ndim() != 4) throw nb::value_error("pictures are [V, H, W, C]");
  }
  size_t count() const { return array.shape(0); }
  int height() const { return static_cast<int>(array.shape(1)); }
  int width() const { return static_cast<int>(array.shape(2)); }
  int channels() const { return static_cast<int>(array.shape(3)); }
  Image At(size_t view) const {
    Image image(width(), height(), channels());
    const auto pixels = static_cast<size_t>(image.plane()), of_each = static_cast<size_t>(channels());
    const float* const from = array.data() + view * pixels * of_each;
    for (size_t c = 0; c < of_each; ++c) {
      float* const to = image.channel(static_cast<int>(c));
      for (size_t i = 0; i < pixels; ++i) to[i] = from[i * of_each + c];
    }
    return image;
  }
  Floats array;
};

// Pictures in memory as one side of a comparison.
class ArrayViews : public ViewSource {
 public:
  ArrayViews(const PictureArray& pictures, std::vector<std::string> names)
      : pictures_(pictures), names_(std::move(names)) {
    for (size_t v = 0; v < names_.size(); ++v) rows_.push_back(v);
  }
  const std::vector<std::string>& names() const override { return names_; }
  bool is_pictures() const override { return true; }
  Result<ImageSize> SizeOf(size_t) const override { return ImageSize{pictures_.width(), pictures_.height()}; }
  Result<Image> Load(size_t view) override {
    Image image = pictures_.At(rows_[view]);
    Clamp01(image);
    return image;
  }
  void KeepOnly(size_t view) override {
    names_ = {names_[view]};
    rows_ = {rows_[view]};
  }

 private:
  const PictureArray& pictures_;
  std::vector<std::string> names_;
  std::vector<size_t> rows_;
};

// A side as it comes from Python: bytes (a path), pictures, a Cloud or None. Lives as long as the call.
struct Side {
  Side(nb::handle of, const std::vector<std::string>& names_of_views) : names(names_of_views) {
    Floats array;
    if (of.is_none()) return;
    if (nb::isinstance<nb::bytes>(of)) {
      path = PathOf(nb::borrow<nb::bytes>(of));
    } else if (nb::try_cast(of, array, /*convert=*/false)) {
      pictures = std::make_unique<PictureArray>(std::move(array));
    } else {
      cloud = std::make_unique<Columns>(of);
    }
  }
  SideInput Input() const {
    SideInput input;
    input.path = path;
    if (pictures) input.pictures = std::make_unique<ArrayViews>(*pictures, names);
    LeaveIfAbandoned();
    if (cloud) input.cloud = std::make_unique<GaussianCloud>(CopyOf(cloud->view()));
    return input;
  }
  std::string path;
  const std::vector<std::string>& names;
  std::unique_ptr<PictureArray> pictures;
  std::unique_ptr<Columns> cloud;
};

std::string Compare(nb::handle a, nb::handle b, nb::handle truth, const std::vector<std::string>& names,
                    const nb::list& words, const CameraSet* cameras, const RunArguments& run) {
  const Side side_a(a, names), side_b(b, names), side_truth(truth, names);
  CompareFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  OrThrow(ParseWords(verb, WordsOf(words)));
  flags.given = GivenOptions(verb);
  return ResultOf(run, [&]() -> Result<std::string> {
    const DeviceUse device;
    for (const Side* side : {&side_a, &side_b, &side_truth}) {
      if (side->cloud) ANCHORSPLAT_RETURN_IF_ERROR(Validate(side->cloud->view()));
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Sides sides,
                                 OpenSides(flags, side_a.Input(), side_b.Input(), side_truth.Input(), cameras));
    std::vector<ViewSource*> sources = {sides.a.get()};
    if (sides.truth) sources.push_back(sides.b.get());
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto results,
                                 CompareToReference(sources, sides.truth ? *sides.truth : *sides.b,
                                                    {.lpips = {}, .color_correct = flags.color_correct}));
    nlohmann::json json = ToJson(results);
    json["device"] = device.ToJson();
    return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  });
}

// Of two arrays [V,H,W,C], view by view.
std::vector<double> Measure(const Floats& a, const Floats& b, bool ssim, const RunArguments& run) {
  const PictureArray left(a), right(b);
  return ResultOf(run, [&]() -> Result<std::vector<double>> {
    std::vector<double> values;
    for (size_t v = 0; v < left.count(); ++v) {
      LeaveIfAbandoned();
      const Image x = left.At(v), y = right.At(v);
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double value, ssim ? Ssim(x, y) : Psnr(x, y));
      values.push_back(value);
    }
    return values;
  });
}

// [H,W,C] of each, one beside the other.
nb::object Sheet(const std::vector<std::string>& captions, const std::vector<Floats>& arrays, const RunArguments& run) {
  std::vector<PictureArray> pictures(arrays.begin(), arrays.end());
  const Image sheet = ResultOf(run, [&] {
    std::vector<Image> images;
    for (const PictureArray& picture : pictures) images.push_back(picture.At(0));
    std::vector<LabelledImage> labelled;
    for (size_t k = 0; k < images.size(); ++k) labelled.push_back({captions[k], "", &images[k]});
    return SideBySide(labelled);
  });
  Buffer<float> values(sheet.pixels.size());
  const auto pixels = static_cast<size_t>(sheet.plane()), channels = static_cast<size_t>(sheet.channels);
  for (size_t c = 0; c < channels; ++c) {
    const float* const from = sheet.channel(static_cast<int>(c));
    for (size_t i = 0; i < pixels; ++i) values[i * channels + c] = from[i];
  }
  return ToArray(std::move(values), {static_cast<size_t>(sheet.height), static_cast<size_t>(sheet.width), channels});
}

}  // namespace

void BindCompare(nb::module_& module) {
  module.def("compare", &Compare, nb::arg("a").none(), nb::arg("b").none(), nb::arg("truth").none(), nb::arg("names"),
             nb::arg("words"), nb::arg("cameras").none(), nb::arg("run"));
  module.def("measure", &Measure, nb::arg("a"), nb::arg("b"), nb::arg("ssim"), nb::arg("run"));
  module.def("sheet", &Sheet, nb::arg("captions"), nb::arg("pictures"), nb::arg("run"));
}

}  // namespace anchorsplat::python

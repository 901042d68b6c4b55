#include "formats/sog/sog_reader.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"
#include "formats/sog/sog_members.h"
#include "formats/sog/sog_pictures.h"

namespace anchorsplat {

namespace {

// Each image is converted and freed before the next.
class SogCloud final : public SogVisitor {
 public:
  GaussianCloud Take() { return std::move(cloud_); }

  void Begin(int64_t count, int sh_degree) override { cloud_.Resize(count, sh_degree); }
  void Quats(ByteImage picture) override {
    ForRows([&](int64_t first, int64_t count) {
      UnpackSogQuats(picture.rgba.data() + 4 * first, count, cloud_.quats.data() + 4 * first);
    });
  }
  void Means(SogMeanRange range, ByteImage low, ByteImage high) override {
    ForRows([&](int64_t first, int64_t count) {
      UnpackSogMeans(range, low.rgba.data() + 4 * first, high.rgba.data() + 4 * first, 4, count,
                     cloud_.means.data() + 3 * first);
    });
  }
  void Scales(std::vector<SogChannel> channels, ByteImage picture) override {
    ForRows([&](int64_t first, int64_t count) {
      UnpackSogScales(channels, picture.rgba.data() + 4 * first, 4, count, cloud_.log_scales.data() + 3 * first);
    });
  }
  void Colors(std::vector<SogChannel> channels, ByteImage picture) override {
    const int64_t stride = cloud_.sh_stride();
    ForRows([&](int64_t first, int64_t count) {
      UnpackSogColors(channels, picture.rgba.data() + 4 * first, count, cloud_.sh.data() + first * stride, stride,
                      cloud_.opacity_logits.data() + first);
    });
  }
  void Harmonics(const SogChannel& values, const ByteImage& labels, const SogPalette& palette) override {
    const int64_t coefficients = cloud_.coefficients() - 1;
    ForRows([&](int64_t first, int64_t count) {
      for (int64_t i = first; i < first + count; ++i) {
        const uint8_t* pixel = labels.rgba.data() + 4 * i;
        const int64_t label = pixel[0] + 256 * pixel[1];
        const int64_t row = label / kSogEntriesPerRow, column = label % kSogEntriesPerRow * coefficients;
        const uint8_t* entry = palette.picture.rgba.data() + 4 * (row * palette.picture.width + column);
        float* sh = cloud_.sh.data() + i * cloud_.sh_stride() + 3;
        for (int64_t k = 0; k < coefficients; ++k) {
          for (int64_t channel = 0; channel < 3; ++channel) sh[3 * k + channel] = values[entry[4 * k + channel]];
        }
      }
    });
  }
  void End(std::optional<RenderMode> mode, std::vector<std::string> comments) override {
    cloud_.render_mode = mode;
    cloud_.origin = TakeOrigin(comments);
    cloud_.comments = std::move(comments);
  }

 private:
  template <typename Rows>
  void ForRows(Rows&& rows) const {
    constexpr int64_t kGrain = 1 << 14;
    ParallelFor(0, cloud_.size(), kGrain, [&](int64_t first, int64_t last) { rows(first, last - first); });
  }

  GaussianCloud cloud_;
};

}  // namespace

Result<FormatFacts> DescribeSog(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSog opened, OpenSog(file));
  const JsonValue meta = opened.json.root();
  FormatFacts facts;
  // Version 1 has no version number.
  const std::optional<JsonValue> version = meta.Find("version");
  facts.Add("version", version ? Printable(version->raw().dump()) : "1",
            opened.members.is_archive() ? ", a ZIP archive" : ", a folder of pictures");
  if (const std::optional<JsonValue> asset = meta.Find("asset"); asset && asset->has("generator")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue generator, asset->Get("generator"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, generator.Text());
    facts.Add("made by", Printable(name));
  }
  const std::optional<JsonValue> harmonics = meta.Find("shN");
  if (harmonics && harmonics->has("count")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue count, harmonics->Get("count"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int entries, count.WholeNumber(1, 65536));
    facts.Add("palette of harmonics", WithThousands(entries), " entries");
  }
  std::string others;
  for (const std::string& name : OtherSogEntries(meta)) others += Cat(others.empty() ? "" : ", ", Printable(name));
  if (!others.empty()) facts.Add("other entries, ignored", Printable(others, 200));
  return facts;
}

uint64_t SogSize(const InputFile& file) {
  uint64_t sum = file.size();
  const Result<std::string> head = file.Head(2);
  if (!head.ok() || *head == "PK") return sum;  // an archive is complete
  const Result<OpenedSog> opened = OpenSog(file);
  if (!opened.ok()) return sum;
  std::set<std::string> seen;
  for (const char* part : {"means", "quats", "scales", "sh0", "shN"}) {
    const std::optional<JsonValue> value = opened->json.root().Find(part);
    const std::optional<JsonValue> list = value ? value->Find("files") : std::nullopt;
    if (!list || !list->raw().is_array()) continue;
    for (const nlohmann::json& name : list->raw()) {
      if (!name.is_string() || !seen.insert(name.get<std::string>()).second) continue;
      sum += opened->members.SizeBeside(name.get<std::string>());
    }
  }
  return sum;
}

Result<GaussianCloud> ReadSog(const InputFile& file, const ReadLimits& limits) {
  SogCloud cloud;
  ANCHORSPLAT_RETURN_IF_ERROR(VisitSog(file, limits, cloud));
  return cloud.Take();
}

}  // namespace anchorsplat

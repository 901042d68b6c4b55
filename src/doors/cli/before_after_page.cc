#include "cli/before_after_page.h"

#include <map>

#include "core/text.h"
#include "formats/opened_splat.h"
#include "viewer/page_writer.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// An estimate that is this much too large may still be wrong.
constexpr double kSure = 0.85;

constexpr const char* kSmaller =
    "enhance without --view, then run `anchorsplat view`: with --folder for any size, or smaller with --sh-degree 0 or "
    "without --before";

}  // namespace

fs::path PagePath(const fs::path& output) { return fs::path(output).replace_extension(".html"); }

Status CheckPages(std::span<const fs::path> outputs) {
  std::map<fs::path, fs::path> taken;
  for (const fs::path& output : outputs) {
    const auto [other, fresh] = taken.emplace(PagePath(output), output);
    if (!fresh) {
      return Error{ErrorCode::kBadArgument,
                   Cat("--view: the pages of ", other->second.string(), " and ", output.string(), " would both be ",
                       PagePath(output).string(), ": enhance them separately, into different folders")};
    }
  }
  return {};
}

Status CheckPageFits(const fs::path& output, const GaussianCloud& before, const EnhanceOptions& options) {
  const auto n = static_cast<double>(before.size());
  const double both = n + static_cast<double>(ExpectedGaussians(before.size(), options));
  constexpr double kLimit{kMaxPageBytes};
  if (both * MostPageBytes(before.sh_degree) <= kLimit) return {};
  const double bytes = both / n * static_cast<double>(EstimatedPageBytes(before));
  if (kSure * bytes <= kLimit) return {};
  return Error{ErrorCode::kBadArgument, Cat(PagePath(output).string(), ": the page of --view would have about ",
                                            HumanBytes(static_cast<uint64_t>(bytes)), ", more than the ",
                                            HumanBytes(kMaxPageBytes), " that browsers open well; ", kSmaller)};
}

Status WritePage(const fs::path& input, const GaussianCloud& before, const fs::path& output, const Enhanced& enhanced,
                 const WriteOptions& options) {
  ViewerPage page;
  page.before = ViewerSplat{&before, input.filename().string(), {}};
  page.after = {&enhanced.cloud, output.filename().string(), {}};
  const EnhanceReport& report = enhanced.report;
  const bool is_read = report.pixel_size_source == PixelSizeSource::kRead && report.reading;
  const double pixel = is_read ? report.reading->pixel : report.pixel_size;
  if (pixel > 0) page.pixel_size = static_cast<float>(pixel);
  page.smaller = kSmaller;
  const Status written = WriteViewerPage(PagePath(output), page, options);
  if (written.ok()) return {};
  return Error{written.error().code,
               Cat(output.string(), " is written, but its page is not: ", written.error().message)};
}

}  // namespace anchorsplat

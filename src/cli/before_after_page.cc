#include "cli/before_after_page.h"

#include <map>
#include <vector>

#include "core/text.h"
#include "formats/opened_splat.h"
#include "viewer/page_writer.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// An estimate that is this much too large may still be wrong.
constexpr double kSure = 0.85;

constexpr const char* kSmaller =
    "enhance without --view and let `anchorsplat view` write a smaller one, of the result alone or with --sh-degree 0";

}  // namespace

fs::path PagePath(const fs::path& output) { return fs::path(output).replace_extension(".html"); }

Status CheckPages(std::span<const fs::path> inputs, std::span<const fs::path> outputs,
                  const std::function<bool(const fs::path&)>& may_replace) {
  std::vector<fs::path> pages;
  std::map<fs::path, fs::path> taken;
  for (const fs::path& output : outputs) {
    pages.push_back(PagePath(output));
    const auto [other, fresh] = taken.emplace(pages.back(), output);
    if (!fresh) {
      return Error{ErrorCode::kBadArgument,
                   Cat("--view: the pages of ", other->second.string(), " and ", output.string(), " would both be ",
                       pages.back().string(), ": enhance them one after the other into different folders")};
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckInputsStay(inputs, pages));
  for (size_t k = 0; k < pages.size(); ++k) {
    std::error_code unknown;
    if (fs::exists(pages[k], unknown) && !may_replace(outputs[k])) {
      return Error{ErrorCode::kExists, Cat(pages[k].string(), " exists; -w replaces it")};
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
  return Error{ErrorCode::kBadArgument, Cat(PagePath(output).string(), ": the page of --view would take about ",
                                            HumanBytes(static_cast<uint64_t>(bytes)), ", more than the ",
                                            HumanBytes(kMaxPageBytes), " a browser opens well; ", kSmaller)};
}

Status WritePage(const fs::path& input, const GaussianCloud& before, const fs::path& output, const Enhanced& enhanced,
                 const WriteOptions& options) {
  ViewerPage page;
  page.before = ViewerSplat{&before, input.filename().string(), {}};
  page.after = {&enhanced.cloud, output.filename().string(), {}};
  // A cautious one is no training pixel to measure by.
  const bool cautious = enhanced.report.pixel_size_source == kCautiousPixelSize;
  if (enhanced.report.pixel_size > 0 && !cautious) page.pixel_size = static_cast<float>(enhanced.report.pixel_size);
  page.smaller = kSmaller;
  const Status written = WriteViewerPage(PagePath(output), page, options);
  if (written.ok()) return {};
  return Error{written.error().code,
               Cat(output.string(), " is written, but its page is not: ", written.error().message)};
}

}  // namespace anchorsplat

#include <nanobind/stl/string.h>

#include <optional>
#include <string>
#include <utility>

#include "bindings.h"
#include "columns.h"
#include "core/text.h"
#include "io/output_memory.h"
#include "request/page_flags.h"
#include "request/words.h"
#include "run.h"
#include "viewer/page_writer.h"

namespace anchorsplat::python {

namespace {

Result<std::vector<std::byte>> PageOf(const PageFlags& flags, const CameraSet* cameras, const CloudView& after,
                                      const CloudView* before, const std::string& name) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(after));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ViewerPage page, MakePage(flags, cameras));
  GaussianCloud shown = CopyOf(after), compared;
  if (flags.mode) shown.render_mode = flags.mode;
  page.after = {&shown, name, {}};
  if (before != nullptr) {
    ANCHORSPLAT_RETURN_IF_ERROR(Validate(*before));
    compared = CopyOf(*before);
    if (flags.mode) compared.render_mode = flags.mode;
    page.before = ViewerSplat{&compared, "before", {}};
  }
  LookAtSplats(page);
  OutputMemory memory;
  page.memory = &memory;
  const std::string path = "page.html";
  ANCHORSPLAT_RETURN_IF_ERROR(WriteViewerPage(path, page));
  return std::move(memory.files.at(path));
}

nb::bytes View(nb::handle after, nb::handle before, const nb::list& words, const CameraSet* cameras,
               const std::string& name, const RunArguments& run) {
  const Columns columns(after);
  std::optional<Columns> others;
  if (!before.is_none()) others.emplace(before);
  PageFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  OrThrow(ParseWords(verb, WordsOf(words)));
  const auto page =
      ResultOf(run, [&] { return PageOf(flags, cameras, columns.view(), others ? &others->view() : nullptr, name); });
  return nb::bytes(reinterpret_cast<const char*>(page.data()), page.size());
}

}  // namespace

void BindView(nb::module_& module) {
  module.def("view", &View, nb::arg("after").none(), nb::arg("before").none(), nb::arg("words"),
             nb::arg("cameras").none(), nb::arg("name"), nb::arg("run"));
}

}  // namespace anchorsplat::python

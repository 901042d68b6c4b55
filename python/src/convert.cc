#include "formats/convert.h"

#include <nanobind/stl/string.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "bindings.h"
#include "request/convert_flags.h"
#include "request/words.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

std::string Convert(const nb::bytes& input, const nb::bytes& output, const nb::list& words, bool overwrite,
                    const RunArguments& run) {
  const std::filesystem::path from = PathOf(input), to = PathOf(output);
  ConvertFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  OrThrow(ParseWords(verb, WordsOf(words)));
  return ResultOf(run, [&]() -> Result<std::string> {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ConvertOptions options, MakeConvertOptions(flags, overwrite));
    ANCHORSPLAT_RETURN_IF_ERROR(CheckConvertEffects(flags, {&to, 1}));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const EditJob job, MakeEditJob(flags.edits, {from}, 0, options));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Converted done, ConvertAndMeasure(job, to, flags.views));
    nlohmann::json json = ToJson(done);
    json["input"] = from.string();
    json["output"] = to.string();
    return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  });
}

}  // namespace

void BindConvert(nb::module_& module) {
  module.def("convert", &Convert, nb::arg("input"), nb::arg("output"), nb::arg("words"), nb::arg("overwrite"),
             nb::arg("run"));
}

}  // namespace anchorsplat::python

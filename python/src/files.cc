#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bindings.h"
#include "columns.h"
#include "formats/cloud_bytes.h"
#include "formats/cloud_io.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "io/atomic_file.h"
#include "request/parse.h"
#include "request/words.h"
#include "request/write_flags.h"
#include "run.h"

namespace anchorsplat::python {

namespace {

// A buffer of somebody's for as long as this lives.
class BorrowedBytes {
 public:
  explicit BorrowedBytes(nb::handle of) {
    if (PyObject_GetBuffer(of.ptr(), &buffer_, PyBUF_SIMPLE) != 0) throw nb::python_error();
  }
  ~BorrowedBytes() { PyBuffer_Release(&buffer_); }
  BorrowedBytes(const BorrowedBytes&) = delete;
  BorrowedBytes& operator=(const BorrowedBytes&) = delete;

  std::span<const std::byte> bytes() const {
    return {static_cast<const std::byte*>(buffer_.buf), static_cast<size_t>(buffer_.len)};
  }

 private:
  Py_buffer buffer_{};
};

nb::tuple ReadPath(const nb::bytes& path, const std::string& format, const RunArguments& run) {
  const std::filesystem::path name = PathOf(path);
  return ToPython(ResultOf(run, [&]() -> Result<GaussianCloud> {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* const known, ParseInputFormat("format", format));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Open(name, known));
    return file.Read();
  }));
}

nb::tuple ReadBytes(nb::handle buffer, const std::string& format, const RunArguments& run) {
  const BorrowedBytes borrowed(buffer);
  return ToPython(ResultOf(run, [&] { return ReadCloudBytes(borrowed.bytes(), format); }));
}

CloudWriteOptions WriteOptionsOf(const nb::list& words, bool overwrite) {
  CloudWriteOptions options;
  CLI::App verb;
  AddWriteFlags(verb, options);
  OrThrow(ParseWords(verb, WordsOf(words)));
  options.overwrite = overwrite;
  return options;
}

void WritePath(const nb::bytes& path, nb::handle cloud, const nb::list& words, bool overwrite,
               const RunArguments& run) {
  const Columns columns(cloud);
  const std::filesystem::path name = PathOf(path);
  const CloudWriteOptions options = WriteOptionsOf(words, overwrite);
  RunEngine(run, [&] { return WriteCloud(name, columns.view(), options); });
}

nb::bytes WriteBytes(const std::string& format, nb::handle cloud, const nb::list& words, const RunArguments& run) {
  const Columns columns(cloud);
  const CloudWriteOptions options = WriteOptionsOf(words, false);
  const auto bytes = ResultOf(run, [&] { return WriteCloudBytes(columns.view(), format, options); });
  return nb::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

void WriteFile(const nb::bytes& path, const nb::bytes& bytes, bool overwrite, const RunArguments& run) {
  const std::filesystem::path name = PathOf(path);
  const std::string_view content(bytes.c_str(), bytes.size());
  RunEngine(run, [&] { return WriteWholeFile(name, content, overwrite); });
}

// (name, extensions, is read, is written) of every format.
nb::list ListFormats() {
  nb::list formats;
  for (const SplatFormat& format : Formats()) {
    nb::list extensions;
    for (const auto& extension : format.extensions) extensions.append(std::string(extension));
    formats.append(
        nb::make_tuple(std::string(format.name), extensions, format.read != nullptr, format.write != nullptr));
  }
  return formats;
}

// Python's own check of a Cloud's shapes and this one are the same.
void CheckCloud(nb::handle cloud) {
  const Columns columns(cloud);
  OrThrow(Validate(columns.view()));
}

}  // namespace

void BindFiles(nb::module_& module) {
  module.def("read_path", &ReadPath, nb::arg("path"), nb::arg("format"), nb::arg("run"));
  module.def("read_bytes", &ReadBytes, nb::arg("buffer"), nb::arg("format"), nb::arg("run"));
  module.def("write_path", &WritePath, nb::arg("path"), nb::arg("cloud").none(), nb::arg("words"), nb::arg("overwrite"),
             nb::arg("run"));
  module.def("write_bytes", &WriteBytes, nb::arg("format"), nb::arg("cloud").none(), nb::arg("words"), nb::arg("run"));
  module.def("write_file", &WriteFile, nb::arg("path"), nb::arg("bytes"), nb::arg("overwrite"), nb::arg("run"));
  module.def("formats", &ListFormats);
  module.def("check_cloud", &CheckCloud, nb::arg("cloud").none());
}

}  // namespace anchorsplat::python

#include "formats/ply/ply_body.h"

#include "core/log.h"
#include "core/text.h"
#include "formats/ply/ply_rows.h"

namespace anchorsplat {

namespace {

std::string Thousands(uint64_t n) { return WithThousands(static_cast<int64_t>(n)); }

// Checks that `count` rows of at least `row_size` bytes fit into `available` bytes: headers may claim anything, and
// counts become allocations.
Status CheckPromise(const InputFile& file, const PlyElement& element, uint64_t row_size, uint64_t begin) {
  const uint64_t available = file.size() - begin;
  if (row_size == 0 || static_cast<uint64_t>(element.count) <= available / row_size) return {};
  return Error{ErrorCode::kBadFile,
               Cat(file.name(), ": byte ", Thousands(file.size()), ": the file ends too early: element \"",
                   Printable(element.name), "\" has ", WithThousands(element.count), " rows of ",
                   element.has_lists() ? "at least " : "", Thousands(row_size), " bytes, ", Thousands(available),
                   " bytes are left for them")};
}

}  // namespace

Result<uint64_t> BeginOfPlyRows(const InputFile& file, const PlyHeader& header, const PlyElement& vertex) {
  uint64_t begin = header.body;
  for (const PlyElement& element : header.elements) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckPromise(file, element, element.row_size(), begin));
    if (&element == &vertex) break;
    if (element.has_lists()) {
      SequentialReader reader(file, begin);
      ANCHORSPLAT_RETURN_IF_ERROR(SkipRowsWithLists(reader, file, element, header.encoding));
      begin = reader.position();
    } else {
      begin += static_cast<uint64_t>(element.count) * element.row_size();
    }
  }
  return begin;
}

void WarnOfSurplus(const InputFile& file, const PlyHeader& header, const PlyElement& vertex) {
  constexpr uint64_t kLineEnd = 2;
  if (header.encoding == PlyEncoding::kAscii || &header.elements.back() != &vertex) return;
  uint64_t end = header.body;  // within the file, as its rows were read
  for (const PlyElement& element : header.elements) {
    if (element.has_lists()) return;  // their length is unknown without reading them again
    end += static_cast<uint64_t>(element.count) * element.row_size();
  }
  if (file.size() <= end + kLineEnd) return;
  LogWarning(Cat(file.name(), ": byte ", Thousands(end), ": ignoring ", Thousands(file.size() - end),
                 " bytes after its ", WithThousands(vertex.count), " Gaussians, as the header does not mention them"));
}

Status CheckGaussianLimit(const InputFile& file, const PlyElement& vertex, const ReadLimits& limits) {
  if (vertex.count <= limits.max_gaussians) return {};
  return Error{ErrorCode::kBadFile, Cat(file.name(), ": line ", vertex.line, ": has ", WithThousands(vertex.count),
                                        " Gaussians, more than the limit of ", WithThousands(limits.max_gaussians))};
}

Status ReadPlyBody(const InputFile& file, const PlyHeader& header, const PlyElement& vertex,
                   const std::function<std::vector<PlyDestination>()>& make_room) {
  if (header.encoding == PlyEncoding::kAscii) {
    // A value needs at least a digit and a separator; the last line end may be missing.
    if ((file.size() - header.body + 1) / 2 / vertex.properties.size() < static_cast<uint64_t>(vertex.count)) {
      return CheckPromise(file, vertex, 2 * vertex.properties.size(), header.body).error();
    }
    return ReadAsciiBody(file, header, vertex, make_room());
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const uint64_t begin, BeginOfPlyRows(file, header, vertex));
  const std::vector<PlyDestination> to = make_room();
  if (!vertex.has_lists()) return ReadFixedRows(file, vertex, header.encoding, begin, 0, vertex.count, to);
  SequentialReader reader(file, begin);
  return ReadRowsWithLists(reader, file, vertex, header.encoding, to);
}

}  // namespace anchorsplat

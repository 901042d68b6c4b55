#include "formats/ply/ply_header.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <unordered_set>
#include <utility>

#include "core/log.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "core/words.h"
#include "formats/ply/render_mode_tag.h"

namespace anchorsplat {

namespace {

struct TypeInfo {
  std::string_view name;
  std::string_view other_name;
  PlyType type;
  int size;
};
constexpr std::array<TypeInfo, 8> kTypes = {{{"char", "int8", PlyType::kInt8, 1},
                                             {"uchar", "uint8", PlyType::kUint8, 1},
                                             {"short", "int16", PlyType::kInt16, 2},
                                             {"ushort", "uint16", PlyType::kUint16, 2},
                                             {"int", "int32", PlyType::kInt32, 4},
                                             {"uint", "uint32", PlyType::kUint32, 4},
                                             {"float", "float32", PlyType::kFloat, 4},
                                             {"double", "float64", PlyType::kDouble, 8}}};

const TypeInfo& Info(PlyType type) { return kTypes[static_cast<size_t>(type)]; }

std::optional<PlyType> TypeFromName(std::string_view name) {
  for (const TypeInfo& info : kTypes) {
    if (name == info.name || name == info.other_name) return info.type;
  }
  return std::nullopt;
}

class HeaderParser {
 public:
  explicit HeaderParser(std::string file) : file_(std::move(file)) {}

  // Handles a line without its end; `done()` is true after end_header.
  Status Line(std::string_view line);
  bool done() const { return done_; }
  PlyHeader& header() { return header_; }

 private:
  Error Bad(const std::string& what) const {
    return {ErrorCode::kBadFile, Cat(file_, ": line ", header_.lines, ": ", what)};
  }
  Error Unexpected(const char* expected, std::string_view found) const {
    return Bad(Cat("expected ", expected, ", found \"", Printable(std::string(found)), "\""));
  }
  Status Format(std::string_view rest);
  Status Element(std::string_view rest);
  Status Property(std::string_view rest);
  Status Comment(std::string_view rest);

  std::string file_;
  PlyHeader header_;
  RenderModeTag mode_;
  std::unordered_set<std::string> names_;  // property names of the current element
  bool has_format_ = false;
  bool done_ = false;
};

Status HeaderParser::Line(std::string_view line) {
  ++header_.lines;
  std::string_view rest = line;
  const std::string_view keyword = TakeWord(rest);
  if (header_.lines == 1) {
    if (keyword != "ply" || !rest.empty()) return Unexpected("\"ply\" (this is not a PLY file)", line);
    return {};
  }
  // other obj_info is dropped
  if (keyword == "obj_info" && UpOf({std::string(rest)})) header_.comments.emplace_back(rest);
  if (keyword.empty() || keyword == "obj_info") return {};
  if (keyword == "comment") {
    return Comment(rest);
  }
  if (keyword == "format") return Format(rest);
  if (keyword == "element") return Element(rest);
  if (keyword == "property") return Property(rest);
  if (keyword == "end_header" && rest.empty()) {
    if (!has_format_) return Bad("the header has no \"format\" line");
    done_ = true;
    return {};
  }
  return Unexpected("format, comment, obj_info, element, property or end_header", line);
}

Status HeaderParser::Format(std::string_view rest) {
  if (has_format_) return Bad("a second \"format\" line");
  const std::string_view whole = rest;
  const std::string_view encoding = TakeWord(rest);
  if (encoding == "ascii") {
    header_.encoding = PlyEncoding::kAscii;
  } else if (encoding == "binary_little_endian") {
    header_.encoding = PlyEncoding::kLittleEndian;
  } else if (encoding == "binary_big_endian") {
    header_.encoding = PlyEncoding::kBigEndian;
  } else {
    return Unexpected("ascii, binary_little_endian or binary_big_endian", whole);
  }
  if (rest != "1.0") return Unexpected("version 1.0", rest);
  has_format_ = true;
  return {};
}

Status HeaderParser::Element(std::string_view rest) {
  PlyElement element;
  element.line = header_.lines;
  element.name = TakeWord(rest);
  if (element.name.empty()) return Bad("an element without a name");
  if (header_.Find(element.name) != nullptr) {
    return Bad(Cat("a second element \"", Printable(element.name), "\""));
  }
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), element.count);
  if (error != std::errc{} || end != rest.data() + rest.size() || element.count < 0) {
    return Unexpected("a count of rows from 0 to 2^63 - 1", rest);
  }
  header_.elements.push_back(std::move(element));
  names_.clear();
  return {};
}

Status HeaderParser::Property(std::string_view rest) {
  if (header_.elements.empty()) return Bad("a property before the first element");
  PlyElement& element = header_.elements.back();
  PlyProperty property;
  property.line = header_.lines;
  std::string_view type = TakeWord(rest);
  if (type == "list") {
    const std::string_view count = TakeWord(rest);
    property.list_count = TypeFromName(count);
    if (!property.list_count || *property.list_count == PlyType::kFloat || *property.list_count == PlyType::kDouble) {
      return Unexpected("an integer type for the count of a list", count);
    }
    type = TakeWord(rest);
  }
  const auto known = TypeFromName(type);
  if (!known) return Unexpected("a type (char uchar short ushort int uint float double)", type);
  property.type = *known;
  property.name = TakeWord(rest);
  if (property.name.empty()) return Bad("a property without a name");
  if (!rest.empty()) return Unexpected("the end of the line", rest);
  if (!names_.insert(property.name).second) {
    return Bad(
        Cat("a second property \"", Printable(property.name), "\" of element \"", Printable(element.name), "\""));
  }
  element.properties.push_back(std::move(property));
  return {};
}

Status HeaderParser::Comment(std::string_view rest) {
  if (const std::optional<WorldOrigin> origin = OriginOfComment(rest)) {
    header_.origin = *origin;
  } else if (IsOriginComment(rest)) {
    return Bad(Cat("\"", Printable(std::string(rest)), "\" is not an origin of the positions: expected three numbers"));
  } else if (!mode_.Take(rest)) {
    header_.comments.emplace_back(rest);
    if (LooksLikeModeTag(rest)) header_.unknown_mode_tags.emplace_back(rest);
  }
  header_.render_mode = mode_.mode();
  return {};
}

}  // namespace

int PlyTypeSize(PlyType type) { return Info(type).size; }
const char* PlyTypeName(PlyType type) { return Info(type).name.data(); }

float FullIntensity(PlyType type) {
  if (IsFloating(type)) return 1;
  const bool is_signed = type == PlyType::kInt8 || type == PlyType::kInt16 || type == PlyType::kInt32;
  return static_cast<float>((uint64_t{1} << (8 * PlyTypeSize(type) - (is_signed ? 1 : 0))) - 1);
}

bool PlyElement::has_lists() const {
  return std::any_of(properties.begin(), properties.end(),
                     [](const PlyProperty& p) { return p.list_count.has_value(); });
}

uint64_t PlyElement::row_size() const {
  uint64_t size = 0;
  for (const PlyProperty& p : properties) size += static_cast<uint64_t>(PlyTypeSize(p.list_count.value_or(p.type)));
  return size;
}

const PlyProperty* PlyElement::Find(std::string_view property) const {
  for (const PlyProperty& p : properties) {
    if (p.name == property) return &p;
  }
  return nullptr;
}

const PlyElement* PlyHeader::Find(std::string_view element) const {
  for (const PlyElement& e : elements) {
    if (e.name == element) return &e;
  }
  return nullptr;
}

std::string PlyComments(std::span<const std::string> comments, std::optional<RenderMode> render_mode,
                        const WorldOrigin& origin) {
  std::string lines;
  for (std::string comment : comments) {
    std::ranges::replace_if(
        comment, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
    lines += "comment " + comment + "\n";
  }
  if (render_mode) {
    for (const std::string& tag : CommentsOf(*render_mode)) lines += "comment " + tag + "\n";
  }
  if (!IsZero(origin)) lines += "comment " + OriginComment(origin) + "\n";
  return lines;
}

void WarnOfUnknownModeTags(const InputFile& file, const PlyHeader& header) {
  if (header.unknown_mode_tags.empty()) return;
  const int64_t more = std::ssize(header.unknown_mode_tags) - 1;
  LogWarning(Cat(file.name(), ": comment \"", Printable(header.unknown_mode_tags.front()), "\"",
                 more > 0 ? Cat(" (and ", more, " more)") : "",
                 " has no known render mode (SplatRenderMode: default or mip, SplatRenderDilation: "
                 "0.1 or 0.3, antialiased 0 or 1): assuming ",
                 NameOf(header.render_mode.value_or(RenderMode::kClassic)),
                 "; pass --mode for another, to verbs that have it"));
}

Result<PlyHeader> ReadPlyHeader(const InputFile& file) {
  if (file.size() == 0) return Error{ErrorCode::kBadFile, Cat(file.name(), ": is empty")};
  HeaderParser parser(file.name());
  std::string bytes;
  size_t at = 0;
  bool lone_cr = false;  // old Macintosh line ends; a LF after CR then belongs to the data
  // Most headers fit in the first piece; longer ones are reread from the start, but lines are parsed once.
  for (const size_t piece : {size_t{16} << 10, kMaxPlyHeader}) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(bytes, file.Head(piece));
    if (!bytes.starts_with("ply")) {
      return Error{ErrorCode::kBadFile, Cat(file.name(), ": byte 0: is not a PLY file: expected \"ply\", found \"",
                                            Printable(bytes.substr(0, 8)), "\"")};
    }
    while (!parser.done()) {
      const size_t end = bytes.find_first_of("\r\n", at);
      // A CR at the end of a piece may be half of a CR LF.
      if (end == std::string::npos || (bytes[end] == '\r' && end + 1 == bytes.size() && bytes.size() < file.size())) {
        break;
      }
      ANCHORSPLAT_RETURN_IF_ERROR(parser.Line(std::string_view(bytes).substr(at, end - at)));
      const bool cr_lf = !lone_cr && bytes[end] == '\r' && end + 1 < bytes.size() && bytes[end + 1] == '\n';
      if (at == 0) lone_cr = bytes[end] == '\r' && !cr_lf;
      at = end + (cr_lf ? 2 : 1);
    }
    if (parser.done()) {
      parser.header().body = at;
      return std::move(parser.header());
    }
    if (bytes.size() == file.size()) break;
  }
  return Error{ErrorCode::kBadFile,
               Cat(file.name(), ": line ", parser.header().lines + 1, ": the header has no \"end_header\" within ",
                   WithThousands(static_cast<int64_t>(bytes.size())), " bytes")};
}

}  // namespace anchorsplat

#include "viewer/page_folder.h"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <string_view>
#include <system_error>

#include "core/file_system.h"
#include "core/fingerprint.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/text.h"
#include "formats/splat_order.h"
#include "io/atomic_file.h"
#include "viewer/base64.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStaged = "data";  // temporary name

// Does not search for repeated strings, which planes of numbers lack: runs and Huffman codes alone are 1 % smaller and
// five times faster.
Result<std::string> DeflateBase64(std::span<const uint8_t> bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, 6, Z_DEFLATED, 15, 9, Z_RLE) != Z_OK) {
    return Error{ErrorCode::kIo, "zlib cannot start to compress the page's data: out of memory?"};
  }
  std::vector<uint8_t> out(deflateBound(&stream, static_cast<uLong>(bytes.size())));
  stream.next_in = const_cast<Bytef*>(bytes.data());  // zlib reads only
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  const int end = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  if (end != Z_STREAM_END) return Error{ErrorCode::kIo, "zlib did not compress the page's data"};
  return Base64(out);
}

// Percent-encodes a name for a URL, so that the page stays ASCII.
std::string UrlOf(const std::string& name) {
  std::string url;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '-' || c == '_' || c == '.' || c == '~') {
      url += c;
    } else {
      constexpr char kDigits[] = "0123456789ABCDEF";
      url += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  return url;
}

bool IsNumber(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
}

// "after-12.js".
bool IsPartName(std::string_view name) {
  for (const std::string_view id : {"after-", "before-"}) {
    if (name.starts_with(id) && name.ends_with(".js"))
      return IsNumber(name.substr(id.size(), name.size() - id.size() - 3));
  }
  return false;
}

// Whether the folder contains only parts of a page.
bool HoldsOnlyParts(const fs::path& folder) {
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    if (!IsPartName(at->path().filename().string())) return false;
  }
  return !failed;
}

// Identifies a splat's data: hash of its decoding parameters and Gaussians.
std::string TokenOf(const CloudView& cloud, const QuantizedCloud& scale) {
  Fingerprint token;
  token.Add(scale.center);
  token.Add(scale.log_scale);
  token.Add(scale.dc);
  token.Add(scale.sh_max);
  token.AddWords(cloud.means);
  token.AddWords(cloud.opacity_logits);
  token.AddWords(cloud.sh);
  return token.text();
}

// Sorts rows by importance, largest first.
void LargestFirst(const CloudView& cloud, std::vector<int64_t>& rows) {
  std::vector<char> usable(static_cast<size_t>(cloud.size()), 0);
  for (const int64_t row : rows) usable[static_cast<size_t>(row)] = 1;
  rows.clear();
  for (const uint32_t row : ImportanceOrder(cloud)) {
    if (usable[row] != 0) rows.push_back(row);
  }
}

}  // namespace

Result<std::vector<std::string>> PackPlanes(std::span<const uint8_t> planes) {
  const size_t pieces = (planes.size() + kPieceBytes - 1) / kPieceBytes;
  std::vector<std::optional<Result<std::string>>> packed(pieces);
  ParallelFor(0, static_cast<int64_t>(pieces), 1, [&](int64_t first, int64_t last) {
    for (auto k = static_cast<size_t>(first); k < static_cast<size_t>(last); ++k) {
      const size_t begin = k * kPieceBytes;
      packed[k] = DeflateBase64(planes.subspan(begin, std::min(kPieceBytes, planes.size() - begin)));
    }
  });
  std::vector<std::string> texts;
  for (auto& piece : packed) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::string text, *std::move(piece));
    texts.push_back(std::move(text));
  }
  return texts;
}

Result<PageFolder> PageFolder::Create(const fs::path& page, OutputMemory* memory) {
  PageFolder folder(page, memory);
  folder.name_ = folder.FreeName();
  if (memory != nullptr) return folder;
  ANCHORSPLAT_ASSIGN_OR_RETURN(StagedFolder staged, StagedFolder::Create(page));
  const fs::path path = staged.path() / kStaged;
  std::error_code failed;
  fs::create_directory(path, failed);
  if (failed) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot make this folder: ", failed.message())};
  folder.staged_.emplace(std::move(staged));
  return folder;
}

std::string PageFolder::FreeName() const {
  const std::string name = page_.stem().string() + ".data";
  for (int number = 1;; ++number) {
    std::string free = number == 1 ? name : Cat(name, "-", number);
    std::error_code ignored;
    const bool taken = fs::symlink_status(page_.parent_path() / free, ignored).type() != fs::file_type::not_found;
    if (memory_ != nullptr || !taken) return free;
  }
}

Result<nlohmann::ordered_json> PageFolder::AddSplat(const CloudView& cloud, MeasuredCloud measured,
                                                    const std::string& id) {
  const std::string token = TokenOf(cloud, measured.scale);
  std::vector<int64_t>& rows = measured.rows;
  LargestFirst(cloud, rows);
  const auto count = static_cast<int64_t>(rows.size());
  Progress progress("page", (count + kPartGaussians - 1) / kPartGaussians);
  nlohmann::ordered_json parts = nlohmann::ordered_json::array();
  for (int64_t begin = 0, number = 0; begin < count; begin += kPartGaussians, ++number) {
    if (StopRequested()) return Error{ErrorCode::kInterrupted, "stopped: no page was written"};
    const auto some = std::span(rows).subspan(static_cast<size_t>(begin),
                                              static_cast<size_t>(std::min(kPartGaussians, count - begin)));
    // Cloud order within a part, as in Quantize; Morton order follows.
    std::ranges::sort(some);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<std::string> texts,
                                 PackPlanes(PlanesOf(cloud, measured.scale, some)));
    const std::string part = Cat(id, "-", number), file = part + ".js";
    const fs::path folder = staged_ ? staged_->path() / kStaged : page_.parent_path() / name_;
    ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile out, OutputFile::Create(folder / file, false, memory_));
    ANCHORSPLAT_RETURN_IF_ERROR(out.Write(Cat("anchorsplatPart(\"", token, "\",\"", part, "\",[")));
    for (size_t k = 0; k < texts.size(); ++k) {
      ANCHORSPLAT_RETURN_IF_ERROR(out.Write(k == 0 ? "\"" : ",\""));
      ANCHORSPLAT_RETURN_IF_ERROR(out.Write(texts[k]));
      ANCHORSPLAT_RETURN_IF_ERROR(out.Write("\""));
    }
    ANCHORSPLAT_RETURN_IF_ERROR(out.Write("]);\n"));
    ANCHORSPLAT_RETURN_IF_ERROR(out.Commit());
    parts.push_back({{"id", part}, {"file", Cat(UrlOf(name_), "/", file)}, {"count", some.size()}, {"token", token}});
    progress.Advance();
  }
  return parts;
}

Status PageFolder::Publish() {
  if (!staged_) return {};
  const std::string from[] = {kStaged}, to[] = {name_};
  return staged_->Publish(from, to);
}

void PageFolder::Keep(bool replaced) {
  if (!staged_) return;
  staged_->Keep();
  if (!replaced) return;
  const std::string name = page_.stem().string() + ".data";
  std::vector<fs::path> old;
  const fs::path folder = page_.has_parent_path() ? page_.parent_path() : fs::path(".");
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    const std::string found = at->path().filename().string();
    const bool of_this = found == name || (found.starts_with(name + "-") && IsNumber(found.substr(name.size() + 1)));
    if (of_this && found != name_ && IsFolder(at->path()) && HoldsOnlyParts(at->path())) old.push_back(at->path());
  }
  for (const fs::path& path : old) fs::remove_all(path, failed);
}

}  // namespace anchorsplat

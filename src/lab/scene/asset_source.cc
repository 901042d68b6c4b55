#include "scene/asset_source.h"

#include <algorithm>
#include <array>
#include <system_error>

#include "core/ascii_lower_case.h"
#include "core/file_system.h"
#include "core/text.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace fs = std::filesystem;

namespace {

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char small = static_cast<char>(c | 0x20);
  return small >= 'a' && small <= 'f' ? small - 'a' + 10 : -1;
}

std::string PercentDecoded(const std::string& text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && HexDigit(text[i + 1]) >= 0 && HexDigit(text[i + 2]) >= 0) {
      out += static_cast<char>(16 * HexDigit(text[i + 1]) + HexDigit(text[i + 2]));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

// Number of folders that a relative path leads up in the end ("a/../../b": 1).
int FoldersUp(const std::string& relative) {
  int up = 0;
  for (const fs::path& part : fs::path(relative).lexically_normal()) up += part == ".." ? 1 : 0;
  return up;
}

bool LeadsAway(const std::string& relative) { return FoldersUp(relative) > 1; }

std::string WithSlashes(std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  return name;
}

// Longer names are rejected, as no file has them.
constexpr size_t kLongestName = 4096;

}  // namespace

std::string AssetSource::Resolve(const std::string& name) const {
  if (name.empty() || name.size() > kLongestName || name.find('\0') != std::string::npos) return {};
  std::string path = WithSlashes(name);
  // Hand-edited material libraries have trailing blanks.
  while (!path.empty() && (path.back() == ' ' || path.back() == '\t' || path.back() == '\r')) path.pop_back();
  const std::string decoded = PercentDecoded(path);
  const auto last = [](const std::string& p) { return p.substr(p.find_last_of('/') + 1); };
  const auto absolute = [](const std::string& p) { return p[0] == '/' || (p.size() > 1 && p[1] == ':'); };
  for (const std::string& candidate : std::array{path, decoded, last(path), last(decoded)}) {
    if (candidate.empty() || absolute(candidate) || candidate.find('\0') != std::string::npos) continue;
    if (LeadsAway(candidate)) continue;
    if (std::string found = Find(candidate); !found.empty()) return found;
  }
  return {};
}

bool AssetSource::Refuses(const std::string& name) const {
  const std::string path = WithSlashes(name);
  return (LeadsAway(path) || LeadsAway(PercentDecoded(path))) && !Has(name);
}

Result<std::string> AssetSource::Read(const std::string& name, uint64_t max_bytes) const {
  const std::string found = Resolve(name);
  if (found.empty() && Refuses(name)) return Error{ErrorCode::kBadFile, Cat(Printable(name), " is ", kRefusal)};
  if (found.empty()) return Error{ErrorCode::kNotFound, Cat(Printable(name), ": no such file")};
  return ReadFound(found, max_bytes);
}

std::string FolderAssets::Find(const std::string& relative) const {
  const fs::path path = folder_ / relative;
  std::error_code error;
  if (IsFile(path)) return path.string();
  // Retries ignoring the case of the file name. Limits the cost of large folders.
  constexpr int kMostEntries = 100'000;
  const std::string wanted = AsciiLowerCase(path.filename().string());
  int seen = 0;
  const fs::path parent = path.parent_path();
  for (fs::directory_iterator it(parent.empty() ? "." : parent, error), end; !error && it != end; it.increment(error)) {
    if (++seen > kMostEntries) break;
    std::error_code ignored;
    if (AsciiLowerCase(it->path().filename().string()) == wanted && it->is_regular_file(ignored)) {
      return it->path().string();
    }
  }
  return {};
}

Result<std::string> FolderAssets::ReadFound(const std::string& found, uint64_t max_bytes) const {
  return ReadFileBytes(found, max_bytes);
}

ZipAssets::ZipAssets(std::shared_ptr<const ZipReader> archive, std::string folder)
    : archive_(std::move(archive)), folder_(std::move(folder)) {
  for (const std::string& member : archive_->Members()) members_.emplace(AsciiLowerCase(member), member);
}

std::string ZipAssets::Find(const std::string& relative) const {
  const std::string path = (fs::path(folder_) / relative).lexically_normal().generic_string();
  const auto found = members_.find(AsciiLowerCase(path));
  // Names ending in a slash are folders.
  return found == members_.end() || found->second.ends_with('/') ? std::string() : found->second;
}

Result<std::string> ZipAssets::ReadFound(const std::string& found, uint64_t max_bytes) const {
  return archive_->Read(found, max_bytes);
}

}  // namespace anchorsplat

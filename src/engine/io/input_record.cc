#include "io/input_record.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <tuple>

#include "core/run_context.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Identity of a file under any name. The birth time, 0 if unknown, distinguishes files that reuse an inode number.
using Identity = std::tuple<uint64_t, uint64_t, int64_t>;

// Identity of a regular file: of `descriptor` if `path` is empty, else of the file with that name.
std::optional<Identity> IdentityOf(int descriptor, const char* path, bool follow) {
  const int flags = (*path == '\0' ? AT_EMPTY_PATH : 0) | (follow ? 0 : AT_SYMLINK_NOFOLLOW);
#ifdef STATX_BTIME
  struct statx wide {};
  if (::statx(descriptor, path, flags, STATX_TYPE | STATX_INO | STATX_BTIME, &wide) == 0) {
    if (!S_ISREG(wide.stx_mode)) return std::nullopt;
    const int64_t birth =
        (wide.stx_mask & STATX_BTIME) != 0 ? wide.stx_btime.tv_sec * 1'000'000'000 + wide.stx_btime.tv_nsec : 0;
    return Identity{(uint64_t{wide.stx_dev_major} << 32) | wide.stx_dev_minor, wide.stx_ino, birth};
  }
#endif
  struct stat info {};
  if (::fstatat(descriptor, path, &info, flags) != 0 || !S_ISREG(info.st_mode)) return std::nullopt;
  return Identity{info.st_dev, info.st_ino, 0};
}

std::optional<Identity> IdentityOf(const fs::path& path) {
  if (path.empty()) return std::nullopt;
  return IdentityOf(AT_FDCWD, path.c_str(), true);
}

struct State {
  std::mutex mutex;
  int records = 0;                         // open records
  std::map<Identity, std::string> inputs;  // and their names
  std::set<Identity> own, written;
};

void Record(const std::optional<Identity>& identity, const fs::path& name) {
  const auto state_of_run = internal::CurrentStorage().Get<State>();
  State& state = *state_of_run;
  const std::lock_guard lock(state.mutex);
  if (state.records == 0 || !identity || state.own.count(*identity) > 0 || state.written.count(*identity) > 0) return;
  state.inputs.emplace(*identity, name.string());
}

}  // namespace

InputRecord::InputRecord() {
  const auto state_of_run = internal::CurrentStorage().Get<State>();
  State& state = *state_of_run;
  const std::lock_guard lock(state.mutex);
  ++state.records;
}

InputRecord::~InputRecord() {
  const auto state_of_run = internal::CurrentStorage().Get<State>();
  State& state = *state_of_run;
  const std::lock_guard lock(state.mutex);
  if (--state.records > 0) return;
  state.inputs.clear();
  state.own.clear();
  state.written.clear();
}

void RecordInput(int descriptor, const fs::path& name) { Record(IdentityOf(descriptor, "", true), name); }

void RecordInput(const fs::path& path) {
  // "-" may be a file too: `convert - scan.ply < scan.ply`.
  Record(path == "-" ? IdentityOf(STDIN_FILENO, "", true) : IdentityOf(path), path);
}

void RecordOwnFile(const fs::path& path) {
  const std::optional<Identity> identity = IdentityOf(path);
  const auto state_of_run = internal::CurrentStorage().Get<State>();
  State& state = *state_of_run;
  const std::lock_guard lock(state.mutex);
  if (state.records > 0 && identity && state.inputs.count(*identity) == 0) state.own.insert(*identity);
}

bool IsOwnFile(const fs::path& path) {
  const std::optional<Identity> identity = IdentityOf(path);
  const auto state_of_run = internal::CurrentStorage().Get<State>();
  State& state = *state_of_run;
  const std::lock_guard lock(state.mutex);
  return identity && state.own.count(*identity) > 0;
}

void RecordWritten(int descriptor) {
  const std::optional<Identity> identity = IdentityOf(descriptor, "", true);
  const auto state_of_run = internal::CurrentStorage().Get<State>();
  State& state = *state_of_run;
  const std::lock_guard lock(state.mutex);
  if (state.records > 0 && identity) state.written.insert(*identity);
}

Status CheckNotInput(const fs::path& output) {
  const std::optional<Identity> identity = IdentityOf(output);
  if (!identity) return {};
  const auto state_of_run = internal::CurrentStorage().Get<State>();
  State& state = *state_of_run;
  const std::lock_guard lock(state.mutex);
  const auto same = state.inputs.find(*identity);
  if (same == state.inputs.end()) return {};
  return Error{ErrorCode::kBadArgument, Cat(output.string(), ": is the input ", same->second,
                                            " itself, which would be lost; write to another name")};
}

Status CheckHoldsNoInput(const fs::path& folder) {
  const auto state_of_run = internal::CurrentStorage().Get<State>();
  State& state = *state_of_run;
  const std::lock_guard lock(state.mutex);
  if (state.inputs.empty()) return {};
  std::error_code code;
  for (fs::recursive_directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    const auto identity = IdentityOf(AT_FDCWD, it->path().c_str(), false);  // a link inside does not contain its target
    const auto same = identity ? state.inputs.find(*identity) : state.inputs.end();
    if (same == state.inputs.end()) continue;
    return Error{ErrorCode::kBadArgument, Cat(folder.string(), ": holds the input ", same->second,
                                              ", which would be lost with it; write to another name")};
  }
  return {};
}

}  // namespace anchorsplat

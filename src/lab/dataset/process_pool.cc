#include "dataset/process_pool.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <map>
#include <system_error>
#include <thread>

#include "core/run_context.h"
#include "core/text.h"

extern char** environ;

namespace anchorsplat {

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPause = std::chrono::milliseconds(20);  // polling interval; processes run for minutes
constexpr double kGraceSeconds = 10;

double SecondsSince(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

struct Running {
  int64_t index = 0;
  Clock::time_point begin;
  bool timed_out = false;
  bool asked = false;  // SIGTERM was sent
  bool killed = false;
  Clock::time_point asked_at;
};

Result<pid_t> Start(const ProcessTask& task) {
  std::vector<char*> arguments;
  for (const std::string& word : task.command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, task.log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  // Own process group, and default signal handling whatever the caller's.
  sigset_t none, defaults;
  sigemptyset(&none);
  sigemptyset(&defaults);
  for (const int signal : {SIGINT, SIGTERM, SIGPIPE}) sigaddset(&defaults, signal);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, task.command[0].c_str(), &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) {
    return Error{ErrorCode::kIo, Cat(task.command[0], ": cannot be started: ", std::strerror(error))};
  }
  return pid;
}

void Ask(pid_t pid, Running& running) {
  if (!running.asked) {
    running.asked = true;
    running.asked_at = Clock::now();
    ::kill(-pid, SIGTERM);
  } else if (!running.killed && SecondsSince(running.asked_at) > kGraceSeconds) {
    running.killed = true;
    ::kill(-pid, SIGKILL);
  }
}

}  // namespace

Status RunProcesses(int64_t count, const std::function<ProcessTask(int64_t)>& task,
                    const std::function<bool(int64_t, const ProcessEnd&)>& ended, const ProcessPoolOptions& options) {
  std::map<pid_t, Running> running;
  int64_t next = 0;
  bool stopping = false;
  Status failed;
  while (true) {
    stopping |= StopRequested();
    while (!stopping && next < count && std::ssize(running) < options.jobs) {
      auto pid = Start(task(next));
      if (!pid.ok()) {
        failed = pid.error();
        stopping = true;
        break;
      }
      Running fresh;
      fresh.index = next++;
      fresh.begin = Clock::now();
      running.emplace(*pid, fresh);
    }
    if (running.empty()) break;
    bool any = false;
    for (auto it = running.begin(); it != running.end();) {
      Running& r = it->second;
      if (options.timeout_seconds > 0 && SecondsSince(r.begin) > options.timeout_seconds) r.timed_out = true;
      if (r.timed_out || stopping) Ask(it->first, r);
      int status = 0;
      const pid_t got = ::waitpid(it->first, &status, WNOHANG);
      if (got == 0 || (got < 0 && errno == EINTR)) {
        ++it;
        continue;
      }
      ::kill(-it->first, SIGKILL);  // also ends its own children
      ProcessEnd end;
      end.seconds = SecondsSince(r.begin);
      end.timed_out = r.timed_out;
      if (got < 0) {
        end.exit_code = -1;
      } else if (WIFSIGNALED(status)) {
        end.signal = WTERMSIG(status);
      } else {
        end.exit_code = WEXITSTATUS(status);
      }
      any = true;
      const int64_t index = r.index;
      it = running.erase(it);
      stopping |= !ended(index, end);
    }
    if (!any) std::this_thread::sleep_for(kPause);
  }
  return failed;
}

std::filesystem::path OwnProgram() {
  std::error_code ignored;
  return std::filesystem::read_symlink("/proc/self/exe", ignored);
}

void DieWithParent() {
  const pid_t parent = ::getppid();
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::raise(SIGTERM);  // the parent ended before prctl
}

}  // namespace anchorsplat

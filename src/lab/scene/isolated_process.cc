#include "scene/isolated_process.h"

#include <fcntl.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <mutex>
#include <new>
#include <stdexcept>

#include "core/text.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define __SANITIZE_ADDRESS__ 1  // clang uses __has_feature
#endif
#endif

namespace anchorsplat {

namespace {

// Message format in both directions: kind, length, bytes.
enum class Kind : uint64_t { kQuestion = 1, kAnswer, kResult, kFailure };

#ifndef MSG_NOSIGNAL
constexpr int MSG_NOSIGNAL = 0;
#endif

bool SendAll(int socket, const void* data, size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    // Without MSG_NOSIGNAL, SIGPIPE would end the program if the other side is gone.
    const ssize_t sent = ::send(socket, at, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    at += sent;
    size -= static_cast<size_t>(sent);
  }
  return true;
}

bool ReceiveAll(int socket, void* data, size_t size) {
  char* at = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = ::recv(socket, at, size, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    size -= static_cast<size_t>(got);
  }
  return true;
}

bool Send(int socket, Kind kind, std::string_view bytes) {
  const uint64_t head[2] = {static_cast<uint64_t>(kind), bytes.size()};
  return SendAll(socket, head, sizeof head) && SendAll(socket, bytes.data(), bytes.size());
}

// Receives block by block, as a corrupted child may announce any length.
bool Receive(int socket, uint64_t longest, Kind& kind, std::string& bytes) {
  uint64_t head[2];
  if (!ReceiveAll(socket, head, sizeof head) || head[1] > longest) return false;
  kind = static_cast<Kind>(head[0]);
  bytes.clear();
  constexpr uint64_t kBlock = 1 << 24;
  while (bytes.size() < head[1]) {
    const size_t at = bytes.size();
    bytes.resize(at + static_cast<size_t>(std::min(kBlock, head[1] - at)));
    if (!ReceiveAll(socket, bytes.data() + at, bytes.size() - at)) return false;
  }
  return true;
}

void Limit(int resource, uint64_t value) {
  rlimit limit{};
  if (::getrlimit(static_cast<decltype(RLIMIT_CPU)>(resource), &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max == RLIM_INFINITY ? value : std::min<rlim_t>(value, limit.rlim_max);
  (void)::setrlimit(static_cast<decltype(RLIMIT_CPU)>(resource), &limit);
}

// Current address space of the process in bytes; 0 if unknown.
uint64_t AddressSpace() {
  unsigned long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return uint64_t{pages} * static_cast<uint64_t>(::sysconf(_SC_PAGESIZE));
}

// Uses only calls that are safe after fork in a multithreaded program.
void PrepareChild(const IsolationLimits& limits, uint64_t address_space) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGINT, SIGTERM, SIGXCPU}) {
    ::signal(signal, SIG_DFL);
  }
  const int silence = ::open("/dev/null", O_WRONLY);
  if (silence >= 0) {
    (void)::dup2(silence, STDOUT_FILENO);
    (void)::dup2(silence, STDERR_FILENO);
  }
#ifdef __linux__
  (void)::prctl(PR_SET_PDEATHSIG, SIGKILL);  // the result would be useless
#endif
  Limit(RLIMIT_CORE, 0);
  Limit(RLIMIT_CPU, static_cast<uint64_t>(limits.max_cpu_seconds));
#ifdef __SANITIZE_ADDRESS__
  (void)address_space;  // the sanitizer's shadow memory takes terabytes of addresses
#else
  if (address_space > 0) Limit(RLIMIT_AS, address_space + limits.max_memory);
#endif
}

[[noreturn]] void RunChild(int socket, const IsolationLimits& limits, uint64_t address_space,
                           const std::function<std::string(const AskParent&)>& work) {
  PrepareChild(limits, address_space);
  bool sent = false;
  try {
    const AskParent ask = [&](const std::string& request) {
      Kind kind{};
      std::string reply;
      if (!Send(socket, Kind::kQuestion, request) || !Receive(socket, UINT64_MAX, kind, reply)) {
        throw std::runtime_error("the parent process is gone");
      }
      return reply;
    };
    sent = Send(socket, Kind::kResult, work(ask));
  } catch (const std::bad_alloc&) {
    sent = Send(socket, Kind::kFailure, "needs more memory than available");
  } catch (const std::exception& e) {
    sent = Send(socket, Kind::kFailure, e.what());
  } catch (...) {
    sent = Send(socket, Kind::kFailure, "failed without a message");
  }
  ::_exit(sent ? 0 : 1);  // skips destructors and buffers of the parent's objects
}

std::string HowItEnded(int status, const IsolationLimits& limits) {
  if (!WIFSIGNALED(status)) return Cat("the reader's process failed (exit code ", WEXITSTATUS(status), ")");
  const int signal = WTERMSIG(status);
  if (signal == SIGKILL) return "the reader was killed: it stopped responding, or the system is out of memory";
  if (signal == SIGXCPU) return Cat("took more than ", limits.max_cpu_seconds, " s to read");
  return Cat("is so damaged that the reader crashed (signal ", signal, ")");
}

}  // namespace

Result<std::string> RunIsolated(const IsolationLimits& limits, const std::function<std::string(const AskParent&)>& work,
                                const std::function<std::string(std::string_view)>& answer) {
  const uint64_t address_space = AddressSpace();
  std::array<int, 2> sockets{};
  pid_t child = -1;
  {
    // Otherwise another thread's child could inherit this child's socket and hide its end.
    static std::mutex forking;
    const std::lock_guard lock(forking);
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, sockets.data()) != 0) {
      return Error{ErrorCode::kIo, Cat("cannot connect to a new process: ", std::strerror(errno))};
    }
    for (const int socket : sockets) (void)::fcntl(socket, F_SETFD, FD_CLOEXEC);
    std::fflush(nullptr);
    child = ::fork();
    if (child == 0) {
      ::close(sockets[0]);
      RunChild(sockets[1], limits, address_space, work);
    }
    ::close(sockets[1]);
  }
  if (child < 0) {
    ::close(sockets[0]);
    return Error{ErrorCode::kIo, Cat("cannot start a process: ", std::strerror(errno))};
  }
  const timeval patience{10 * limits.max_cpu_seconds, 0};
  (void)::setsockopt(sockets[0], SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  Kind kind{};
  std::string bytes;
  bool connected = true;
  while ((connected = Receive(sockets[0], limits.max_message, kind, bytes)) && kind == Kind::kQuestion) {
    if (!Send(sockets[0], Kind::kAnswer, answer(bytes))) break;
  }
  ::close(sockets[0]);
  if (!connected) ::kill(child, SIGKILL);  // it may still be sending too much; harmless if dead
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (connected && kind == Kind::kResult) return bytes;
  if (connected && kind == Kind::kFailure) return Error{ErrorCode::kBadFile, bytes};
  return Error{ErrorCode::kBadFile, HowItEnded(status, limits)};
}

}  // namespace anchorsplat

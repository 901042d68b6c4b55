#include "run.h"

#include <nanobind/stl/string.h>
#include <pthread.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <variant>

#include "bindings.h"
#include "core/log.h"
#include "core/run_context.h"
#include "gpu/open_gpu.h"
#include "io/input_record.h"
#include "request/device_flags.h"
#include "request/words.h"

namespace anchorsplat::python {

namespace {

struct Said {
  LogLevel level;
  std::string text;
};

struct TaskState {
  std::string name;
  int64_t done = 0, total = 0;
  std::string note;
  bool ended = false;
};

// Keeps events until the calling thread asks. Of a task only the newest state is kept: a step may take microseconds.
class EventQueue : public LogSink {
 public:
  using Event = std::variant<Said, TaskState>;

  void Message(LogLevel level, const std::string& text) override {
    const std::lock_guard lock(mutex_);
    events_.emplace_back(Said{level, text});
  }
  void TaskBegin(const std::string& name, int64_t total) override {
    const std::lock_guard lock(mutex_);
    task_ = {.name = name, .done = 0, .total = total, .note = {}, .ended = false};
    Put();
  }
  void TaskProgress(int64_t done, const std::string& note) override {
    const std::lock_guard lock(mutex_);
    task_.done = done;
    task_.note = note;
    Put();
  }
  void TaskEnd() override {
    const std::lock_guard lock(mutex_);
    task_.ended = true;
    Put();
  }

  std::deque<Event> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(events_, {});
  }

 private:
  void Put() {
    if (!events_.empty()) {
      if (auto* last = std::get_if<TaskState>(&events_.back()); last != nullptr && !last->ended) {
        if (last->name == task_.name && last->total == task_.total && task_.done >= last->done) {
          *last = task_;
          return;
        }
      }
    }
    events_.emplace_back(task_);
  }

  std::mutex mutex_;
  std::deque<Event> events_;
  TaskState task_;
};

// What the library says is UTF-8 but for file names, which are bytes.
nb::object Text(const std::string& text) {
  PyObject* decoded = PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace");
  if (decoded == nullptr) throw nb::python_error();
  return nb::steal(decoded);
}

void Tell(const nb::object& tell, EventQueue& queue) {
  const auto events = queue.Take();
  if (events.empty() || tell.is_none()) return;
  nb::list list;
  for (const EventQueue::Event& event : events) {
    if (const auto* said = std::get_if<Said>(&event)) {
      list.append(nb::make_tuple(said->level == LogLevel::kInfo ? "info" : "warning", Text(said->text)));
    } else {
      const auto& task = std::get<TaskState>(event);
      list.append(nb::make_tuple("task", Text(task.name), task.done, task.total, Text(task.note), task.ended));
    }
  }
  tell(list);
}

Status WithoutExceptions(const std::function<Status()>& work) try { return work(); } catch (const RunAbandoned&) {
  return Error{ErrorCode::kInterrupted, "stopped"};
} catch (const std::bad_alloc&) {
  return Error{ErrorCode::kIo, "there is not enough memory"};
} catch (const std::exception& error) {
  return Error{ErrorCode::kIo, std::string("unexpected: ") + error.what() + " (please report this)"};
}

const char* ClassOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::kBadArgument:
      return "BadArgumentError";
    case ErrorCode::kNotFound:
      return "NotFoundError";
    case ErrorCode::kBadFile:
      return "BadFileError";
    case ErrorCode::kExists:
      return "ExistsError";
    case ErrorCode::kIo:
      return "IoError";
    default:
      return "StoppedError";
  }
}

// Messages name the command line's way to replace a file.
std::string InPython(std::string message) {
  for (const std::string_view flag : {"-w replaces", "-w begins"}) {
    const size_t at = message.find(flag);
    if (at != std::string::npos) message.replace(at, 2, "overwrite=True");
  }
  return message;
}

// The interpreter ends, and with it every daemon thread that asks for the GIL, in a way that C++ takes for an exception
// which nobody may catch. Calls of such threads end before that, by this, and their threads ask for nothing any more.
struct Ending {
  std::mutex mutex;
  std::condition_variable changed;
  int calls = 0;  // in the engine
  std::optional<std::thread::id> by;

  bool MustPark() {
    const std::lock_guard lock(mutex);
    return by && *by != std::this_thread::get_id();
  }
  void Count(int more) {
    const std::lock_guard lock(mutex);
    calls += more;
    changed.notify_all();
  }
};
Ending* the_ending = new Ending;  // never destroyed: parked threads outlive static objects

Ending& TheEnding() { return *the_ending; }

// The child of a fork has none of the threads that calls are in.
void BeginAfterFork() { the_ending = new Ending; }

// By atexit, before threads are ended.
void EndCalls() {
  Ending& ending = TheEnding();
  const nb::gil_scoped_release others_go_on;
  std::unique_lock lock(ending.mutex);
  ending.by = std::this_thread::get_id();
  ending.changed.wait(lock, [&] { return ending.calls == 0; });
}

[[noreturn]] void Park() {
  for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

void Raise(const std::exception_ptr& thrown, void*) {
  try {
    std::rethrow_exception(thrown);
  } catch (const EngineError& failed) {
    const nb::object type = nb::module_::import_("anchorsplat._errors").attr(ClassOf(failed.error.code));
    PyErr_SetObject(type.ptr(), Text(InPython(failed.error.message)).ptr());
  }
}

}  // namespace

void RunEngine(const RunArguments& run, const std::function<Status()>& work) {
  const auto queue = std::make_shared<EventQueue>();
  std::atomic<bool> stop{false}, abandon{false};
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  Status status;
  std::thread worker([&] {
    {
      const RunScope scope({.threads = run.threads,
                            .sink = queue,
                            .stop = &stop,
                            .abandon = &abandon,
                            .device = run.device,
                            .max_gpu_memory = run.max_gpu_memory});
      const InputRecord record;
      status = WithoutExceptions([&]() -> Status {
        if (const auto gpu = GpuOfRun(); !gpu.ok()) return gpu.error();  // before the work
        return work();
      });
    }
    const std::lock_guard lock(mutex);
    done = true;
    changed.notify_one();
  });
  TheEnding().Count(1);
  std::optional<nb::python_error> raised;
  for (bool over = false; !over;) {
    {
      const nb::gil_scoped_release others_go_on;
      std::unique_lock lock(mutex);
      over = changed.wait_for(lock, std::chrono::milliseconds(50), [&] { return done; });
      if (TheEnding().MustPark()) {
        abandon = stop = true;
        lock.unlock();
        worker.join();
        TheEnding().Count(-1);
        Park();
      }
    }
    try {
      if (PyErr_CheckSignals() != 0) throw nb::python_error();
      if (!raised) Tell(run.tell, *queue);
    } catch (nb::python_error& error) {
      abandon = !run.patient || raised || stop;
      stop = true;
      if (!raised) raised.emplace(std::move(error));
    }
  }
  {
    const nb::gil_scoped_release others_go_on;
    worker.join();
    TheEnding().Count(-1);
  }
  if (raised) throw nb::python_error(std::move(*raised));
  OrThrow(status);
}

void BindRun(nb::module_& module) {
  nb::class_<RunArguments>(module, "RunArguments")
      .def(
          "__init__",
          [](RunArguments* self, int threads, nb::object tell, bool patient, const nb::list& words) {
            if (threads < 0 || threads > 1024) {
              throw EngineError(
                  {ErrorCode::kBadArgument, "--threads: must be 0 to 1024, found " + std::to_string(threads)});
            }
            DeviceFlags flags;
            CLI::App verb;
            flags.AddTo(verb);
            OrThrow(ParseWords(verb, WordsOf(words)));
            new (self) RunArguments{threads, std::move(tell), patient, flags.device, flags.max_gpu_memory};
          },
          nb::arg("threads"), nb::arg("tell").none(), nb::arg("patient"), nb::arg("device_words"));
  module.def(
      "set_gpu_folder", [](const nb::bytes& path) { SetGpuLibraryHint(PathOf(path)); }, nb::arg("path"));
  nb::register_exception_translator(Raise);
  nb::module_::import_("atexit").attr("register")(nb::cpp_function(&EndCalls));
  ::pthread_atfork(nullptr, nullptr, BeginAfterFork);
}

}  // namespace anchorsplat::python

#include <emscripten/em_js.h>
#include <emscripten/emscripten.h>

#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

#include "core/parallel.h"
#include "web/engine.h"

// The engine's interface for JavaScript: memory for a request, the
// call, and the location of its answer.

// Progress goes to the listener in the module, which only the calling thread can reach. It includes the steps of other
// threads.
EM_JS_DEPS(anchorsplat_tell_needs, "$UTF8ToString");
// clang-format off
EM_JS(void, anchorsplat_tell, (const char* task, double done, double total, const char* note), {
  if (Module.tell) Module.tell(UTF8ToString(task), done, total, UTF8ToString(note));
})
// clang-format on

namespace {

using anchorsplat::web::Engine;
using anchorsplat::web::Reply;

Engine& TheEngine() {
  static Engine engine([](std::string_view task, int64_t done, int64_t total, std::string_view note) {
    anchorsplat_tell(std::string(task).c_str(), static_cast<double>(done), static_cast<double>(total),
                     std::string(note).c_str());
  });
  return engine;
}

Reply& LastReply() {
  static Reply reply;
  return reply;
}

}  // namespace

extern "C" {

// Threads for loops, at most as many as the module was started with; one in a module without threads.
EMSCRIPTEN_KEEPALIVE void anchorsplat_threads(int threads) { anchorsplat::SetThreadCount(threads); }

// Null if there is not enough memory.
EMSCRIPTEN_KEEPALIVE void* anchorsplat_allocate(size_t bytes) { return std::malloc(bytes); }
EMSCRIPTEN_KEEPALIVE void anchorsplat_free(void* memory) { std::free(memory); }

// `request` is JSON. Returns the length of the answer's JSON; both pieces of memory stay the caller's.
EMSCRIPTEN_KEEPALIVE size_t anchorsplat_call(const char* request, size_t request_bytes, const std::byte* data,
                                             size_t data_bytes) {
  LastReply() = {};
  LastReply() = TheEngine().Call({request, request_bytes}, {data, data_bytes});
  return LastReply().json.size();
}

EMSCRIPTEN_KEEPALIVE const char* anchorsplat_json() { return LastReply().json.data(); }
EMSCRIPTEN_KEEPALIVE size_t anchorsplat_blocks() { return LastReply().blocks.size(); }
EMSCRIPTEN_KEEPALIVE const void* anchorsplat_block(size_t k) { return LastReply().blocks[k].data(); }
EMSCRIPTEN_KEEPALIVE size_t anchorsplat_block_bytes(size_t k) { return LastReply().blocks[k].size(); }
}

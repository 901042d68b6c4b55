#include <emscripten/em_js.h>
#include <emscripten/emscripten.h>

#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

#include "core/parallel.h"
#include "web/engine.h"

// What JavaScript sees of the engine: memory for a request, the
// call, and where its answer lies.

// Progress goes to the listener that the page has put into the module, which only the thread that calls knows: what
// others have done is in its next word.
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

// Threads that loops may use, of as many as the module was started with; a module without threads has one.
EMSCRIPTEN_KEEPALIVE void anchorsplat_threads(int threads) { anchorsplat::SetThreadCount(threads); }

// Null where there is not so much memory.
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

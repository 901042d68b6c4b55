// Answers the requests of a file with the native engine, for comparison with the module (scripts/web/test.mjs):
// web_reference REQUESTS OUT
//
// Every line of REQUESTS is a request; its "data", if any, is the path of a file with the bytes. The answer to line k
// goes to OUT/k.json and its blocks to OUT/k-0.bin, OUT/k-1.bin, …; "seconds" is added to it. One thread, and no wider
// vectors than WebAssembly has.
#include <hwy/highway.h>
#include <hwy/targets.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "core/parallel.h"
#include "web/engine.h"

namespace {

std::string BytesOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "web_reference REQUESTS OUT\n";
    return 2;
  }
  anchorsplat::SetThreadCount(1);
#if HWY_ARCH_X86
  hwy::SetSupportedTargetsForTest(HWY_SSE4);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
#endif
  const std::filesystem::path out = argv[2];
  anchorsplat::web::Engine engine(nullptr);
  std::ifstream requests(argv[1]);
  int k = 0;
  for (std::string line; std::getline(requests, line); ++k) {
    nlohmann::json request = nlohmann::json::parse(line);
    const std::string data = request.contains("data") ? BytesOf(request["data"].get<std::string>()) : "";
    request.erase("data");
    const auto begin = std::chrono::steady_clock::now();
    const anchorsplat::web::Reply reply = engine.Call(request.dump(), std::as_bytes(std::span(data)));
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    nlohmann::json answer = nlohmann::json::parse(reply.json);
    answer["seconds"] = seconds.count();
    std::ofstream(out / (std::to_string(k) + ".json")) << answer.dump();
    for (size_t j = 0; j < reply.blocks.size(); ++j) {
      std::ofstream block(out / (std::to_string(k) + "-" + std::to_string(j) + ".bin"), std::ios::binary);
      block.write(reinterpret_cast<const char*>(reply.blocks[j].data()),
                  static_cast<std::streamsize>(reply.blocks[j].size()));
    }
  }
  return 0;
}

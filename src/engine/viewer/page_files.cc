#include "viewer/page_files.h"

#include <array>
#include <utility>

#include "viewer/page.h"

namespace anchorsplat {

std::string_view PageFile(std::string_view name) {
  const std::array<std::pair<std::string_view, std::string_view>, 11> files = {{{"app.js", page::kAppJs},
                                                                                {"box.js", page::kBoxJs},
                                                                                {"camera.js", page::kCameraJs},
                                                                                {"interface.js", page::kInterfaceJs},
                                                                                {"page.css", page::kPageCss},
                                                                                {"page.html", page::kPageHtml},
                                                                                {"payload.js", page::kPayloadJs},
                                                                                {"pictures.js", page::kPicturesJs},
                                                                                {"renderer.js", page::kRendererJs},
                                                                                {"shaders.js", page::kShadersJs},
                                                                                {"worker.js", page::kWorkerJs}}};
  for (const auto& [file, text] : files) {
    if (file == name) return text;
  }
  return {};
}

}  // namespace anchorsplat

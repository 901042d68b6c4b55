#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/format_facts.h"

namespace anchorsplat::web {

// Answer of a call: a JSON object, and blocks of bytes, which are valid until the next call.
struct Reply {
  std::string json;
  std::vector<std::span<const std::byte>> blocks;
};

// Progress of a long call: name of the task, steps done, total steps (0: unknown), a short note.
using ProgressListener = std::function<void(std::string_view task, int64_t done, int64_t total, std::string_view note)>;

// The engine for web pages and Node scripts: splats are numbers, requests and answers JSON, large data blocks of bytes.
// Only Cameras() uses the disk, for a temporary folder.
//
//   {"verb": "open", "name": "scan.ply"} + the file         → {"cloud": 1, "gaussians": …, …}
//   {"verb": "info", "cloud": 1}                            → what `anchorsplat info --json` says
//   {"verb": "enhance", "cloud": 1, "words": ["--upscale=4"], "seed": 0, "cameras": 1}  → {"cloud": 2, "report": {…}}
//   {"verb": "edit", "cloud": 1, "words": ["--up=z", "--filter-floaters"]}
//        → as open, and {"actions": [{"action", "taken", "left"}], "world": {"rotation": [9], "translation": [3],
//        "scale": s}}: what each edit removed, and the map from old to new world coordinates. With --dry-run
//        among the words only the actions
//   {"verb": "filter", "cloud": 1, "upscale": 4}            → {"gain": g}: variance that the filter adds, training
//   pixels²
//   {"verb": "write", "cloud": 2, "format": "spz", "words": []}  → one block: the file
//   {"verb": "page", "after": 2, "before": 1, "name": "…", "words": []}  → one block: the page of `anchorsplat view`
//   {"verb": "render", "cloud": 2, "words": ["--size=512x512"], "transparent": false, "cameras": 1}
//        → {"views": V, "height": H, "width": W, "channels": C}, one block: float32 [V,H,W,C]
//   {"verb": "columns", "cloud": 2}                         → five blocks: means, log_scales, quats, opacity_logits, sh
//   {"verb": "put", "gaussians": N, "sh_degree": 3, "render_mode": null, "comments": []} + the five, one after the
//   other
//        → as open
//   {"verb": "cameras", "files": [{"name": "transforms.json", "bytes": 12}]} + the files, one after the other
//        → {"cameras": 1, "views": 100}
//   {"verb": "release", "cloud": 1} or {"verb": "release", "cameras": 1}
//   {"verb": "formats"}                                     → {"formats": [{"name", "extensions", "reads", "writes"}]}
//
// `words` are options of the command line, with its checks and messages. Every answer has "messages": [{"level",
// "text"}]. A failed call has "error": {"code", "message"} instead of a result; the engine stays usable.
class Engine {
 public:
  explicit Engine(ProgressListener listener);

  Reply Call(std::string_view request, std::span<const std::byte> data);

 private:
  struct OpenCloud {
    GaussianCloud cloud;
    std::string name;    // of its file, for messages; empty: none
    std::string format;  // of its file
    FormatFacts facts;   // from the file
    uint64_t bytes = 0;  // of its file
  };
  struct Answer;

  Result<Answer> Run(const nlohmann::json& request, std::span<const std::byte> data);
  Result<Answer> Open(const nlohmann::json& request, std::span<const std::byte> data);
  Result<Answer> Put(const nlohmann::json& request, std::span<const std::byte> data);
  Result<Answer> Info(const nlohmann::json& request);
  Result<Answer> Enhance(const nlohmann::json& request);
  Result<Answer> Edit(const nlohmann::json& request);
  Result<Answer> Filter(const nlohmann::json& request);
  Result<Answer> Write(const nlohmann::json& request);
  Result<Answer> Page(const nlohmann::json& request);
  Result<Answer> Render(const nlohmann::json& request);
  Result<Answer> Columns(const nlohmann::json& request);
  Result<Answer> ReadCameraFiles(const nlohmann::json& request, std::span<const std::byte> data);
  Result<Answer> Release(const nlohmann::json& request);

  Answer Keep(OpenCloud open);
  Result<OpenCloud*> FindCloud(const nlohmann::json& request, const char* key);
  Result<const CameraSet*> FindCameras(const nlohmann::json& request);

  ProgressListener listener_;
  std::map<int64_t, std::unique_ptr<OpenCloud>> clouds_;
  std::map<int64_t, CameraSet> cameras_;
  int64_t last_ = 0;              // last handle given out
  std::vector<std::byte> bytes_;  // of the last answer
  std::vector<float> floats_;
};

}  // namespace anchorsplat::web

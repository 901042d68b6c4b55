#include "web/engine.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "cameras/camera_io.h"
#include "core/cloud_view.h"
#include "core/error_name.h"
#include "core/log.h"
#include "core/run_context.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "core/world_up.h"
#include "enhance/enhance.h"
#include "enhance/filter.h"
#include "formats/cloud_bytes.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "io/input_file.h"
#include "io/output_memory.h"
#include "reading/treatment.h"
#include "render/constants.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"
#include "request/enhance_flags.h"
#include "request/findings.h"
#include "request/page_flags.h"
#include "request/parse.h"
#include "request/views.h"
#include "request/words.h"
#include "request/write_flags.h"
#include "viewer/page_writer.h"
#include "web/addresses.h"
#include "web/edits.h"
#include "web/request.h"

namespace anchorsplat::web {

struct Engine::Answer {
  Json json = Json::object();
  std::vector<std::span<const std::byte>> blocks;
};

namespace {

// Parses options of a verb, declared by `flags.AddTo`; returns the given ones. Open cameras replace the file of
// --cameras.
template <typename Flags>
Result<std::vector<std::string>> ReadWords(const Json& request, Flags& flags, const CameraSet* cameras = nullptr) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<std::string> words, WordsOf(request));
  if (cameras != nullptr) words.emplace_back("--cameras=cameras in memory");
  CLI::App verb;
  flags.AddTo(verb);
  ANCHORSPLAT_RETURN_IF_ERROR(ParseWords(verb, std::move(words)));
  return GivenOptions(verb);
}

struct WriteFlags {
  CloudWriteOptions options;
  void AddTo(CLI::App& verb) { AddWriteFlags(verb, options); }
};

Result<std::optional<RenderMode>> ModeOf(const Json& request) {
  const std::string name = TextOf(request, "render_mode");
  if (name.empty()) return std::optional<RenderMode>();
  if (const std::optional<RenderMode> mode = RenderModeNamed(name)) return mode;
  return BadRequest("has a 'render_mode' other than classic, antialiased or mip");
}

// Collects messages for the answer of a call; passes progress on at once.
class CallSink : public LogSink {
 public:
  explicit CallSink(const ProgressListener& listener) : listener_(listener) {}

  void Message(LogLevel level, const std::string& text) override {
    const char* name = level == LogLevel::kWarning ? "warning" : level == LogLevel::kError ? "error" : "info";
    messages_.push_back({{"level", name}, {"text", text}});
  }
  void TaskBegin(const std::string& name, int64_t total) override {
    task_ = name;
    total_ = total;
    Tell(0, "");
  }
  void TaskProgress(int64_t done, const std::string& note) override { Tell(done, note); }
  void TaskEnd() override { Tell(total_, ""); }

  Json TakeMessages() { return std::move(messages_); }

 private:
  void Tell(int64_t done, std::string_view note) const {
    if (listener_) listener_(task_, done, total_, note);
  }

  const ProgressListener& listener_;
  Json messages_ = Json::array();
  std::string task_;
  int64_t total_ = 0;
};

std::span<const std::byte> BlockOf(std::span<const float> values) { return std::as_bytes(values); }

Json Described(const GaussianCloud& cloud) {
  return {{"gaussians", cloud.size()},
          {"sh_degree", cloud.sh_degree},
          {"render_mode", cloud.render_mode ? Json(NameOf(*cloud.render_mode)) : Json()},
          {"comments", cloud.comments},
          {"origin", cloud.origin}};
}

// Removes its content on destruction.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code failed;
    const std::filesystem::path parent = std::filesystem::temp_directory_path(failed);
    for (int k = 0; k < 1000 && !failed; ++k) {
      path_ = parent / Cat("anchorsplat-cameras-", k);
      if (std::filesystem::create_directory(path_, failed)) return;
    }
    path_.clear();
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// A name without folders.
bool IsPlain(const std::string& name) {
  return !name.empty() && name != "." && name != ".." && name.find('/') == std::string::npos &&
         name.find('\0') == std::string::npos;
}

Result<CameraSet> OfOneSize(CameraSet set) {
  for (const Camera& camera : set.cameras) {
    const Pinhole &first = set.cameras.front().intrinsics, &k = camera.intrinsics;
    if (k.width == first.width && k.height == first.height) continue;
    return Error{ErrorCode::kBadArgument, Cat("cameras ", set.cameras.front().name, " and ", camera.name,
                                              " have different sizes and cannot be one array: pass --size or --view")};
  }
  return set;
}

}  // namespace

Engine::Engine(ProgressListener listener) : listener_(std::move(listener)) {}

Reply Engine::Call(std::string_view request, std::span<const std::byte> data) {
  bytes_ = {};
  floats_ = {};
  const auto sink = std::make_shared<CallSink>(listener_);
  const RunScope run({.sink = sink});
  Reply reply;
  Json json = Json::object();
  const auto fail = [&](const Error& error) {
    json["error"] = {{"code", CodeName(error.code)}, {"message", error.message}};
  };
  try {
    const Json parsed = Json::parse(request, nullptr, /*allow_exceptions=*/false);
    if (parsed.is_object()) {
      auto answer = Run(parsed, data);
      if (answer.ok()) {
        json = std::move(answer->json);
        reply.blocks = std::move(answer->blocks);
      } else {
        fail(answer.error());
      }
    } else {
      fail(BadRequest("is not a JSON object"));
    }
  } catch (const std::bad_alloc&) {
    fail({ErrorCode::kIo, "not enough memory for this splat"});
  } catch (const std::length_error&) {  // an array too large for this machine
    fail({ErrorCode::kIo, "not enough memory for this splat"});
  } catch (const std::exception& error) {
    fail({ErrorCode::kIo, Cat("unexpected failure: ", error.what())});
  }
  json["messages"] = sink->TakeMessages();
  reply.json = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return reply;
}

Result<Engine::Answer> Engine::Run(const Json& request, std::span<const std::byte> data) {
  const std::string verb = TextOf(request, "verb");
  if (verb == "open") return Open(request, data);
  if (verb == "put") return Put(request, data);
  if (verb == "info") return Info(request);
  if (verb == "enhance") return Enhance(request);
  if (verb == "edit") return Edit(request);
  if (verb == "filter") return Filter(request);
  if (verb == "write") return Write(request);
  if (verb == "page") return Page(request);
  if (verb == "render") return Render(request);
  if (verb == "columns") return Columns(request);
  if (verb == "cameras") return ReadCameraFiles(request, data);
  if (verb == "release") return Release(request);
  if (verb == "formats") {
    Answer answer;
    for (const SplatFormat& format : Formats()) {
      answer.json["formats"].push_back({{"name", format.name},
                                        {"extensions", format.extensions},
                                        {"reads", format.read != nullptr},
                                        {"writes", format.write != nullptr}});
    }
    return answer;
  }
  return BadRequest(Cat("has an unknown verb '", Printable(verb), "'"));
}

Engine::Answer Engine::Keep(OpenCloud open) {
  Answer answer;
  answer.json = Described(open.cloud);
  answer.json["format"] = open.format.empty() ? Json() : Json(open.format);
  answer.json["cloud"] = ++last_;
  clouds_[last_] = std::make_unique<OpenCloud>(std::move(open));
  return answer;
}

Result<Engine::OpenCloud*> Engine::FindCloud(const Json& request, const char* key) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t number, NumberOf(request, key, last_));
  const auto found = clouds_.find(number);
  if (found != clouds_.end()) return found->second.get();
  return BadRequest(Cat("names no open splat as '", key, "'"));
}

Result<const CameraSet*> Engine::FindCameras(const Json& request) {
  const CameraSet* const none = nullptr;
  if (Find(request, "cameras") == nullptr) return none;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t number, NumberOf(request, "cameras", last_));
  const auto found = cameras_.find(number);
  if (found == cameras_.end()) return BadRequest("names no open cameras");
  const CameraSet* const cameras = &found->second;
  return cameras;
}

Result<Engine::Answer> Engine::Open(const Json& request, std::span<const std::byte> data) {
  const std::string name = TextOf(request, "name");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* const format, ParseInputFormat("format", TextOf(request, "format")));
  const std::string_view bytes(reinterpret_cast<const char*>(data.data()), data.size());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file,
                               OpenedSplat::Of(InputFile::View(name.empty() ? "the splat" : name, bytes), format));
  OpenCloud open;
  ANCHORSPLAT_ASSIGN_OR_RETURN(open.cloud, file.Read());
  open.name = name;
  open.format = file.format()->name;
  open.bytes = file.bytes();
  if (file.format()->describe != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(open.facts, file.format()->describe(file.input()));
  }
  return Keep(std::move(open));
}

Result<Engine::Answer> Engine::Put(const Json& request, std::span<const std::byte> data) {
  constexpr int64_t kMost = int64_t{1} << 28;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t count, NumberOf(request, "gaussians", kMost));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t degree, NumberOf(request, "sh_degree", kMaxShDegree));
  const int64_t floats = count * (11 + 3 * ShCoefficients(static_cast<int>(degree)));
  if (data.size() % sizeof(float) != 0 || static_cast<uint64_t>(floats) != data.size() / sizeof(float)) {
    return BadRequest(Cat("lists ", count, " Gaussians of SH degree ", degree, ", which need ", 4 * floats,
                          " bytes, but has ", data.size()));
  }
  OpenCloud open;
  ANCHORSPLAT_ASSIGN_OR_RETURN(open.cloud.render_mode, ModeOf(request));
  ANCHORSPLAT_ASSIGN_OR_RETURN(open.cloud.comments, WordsOf(request, "comments"));
  if (const Json* const origin = Find(request, "origin")) {
    const bool is_point = origin->is_array() && origin->size() == 3 &&
                          std::ranges::all_of(*origin, [](const Json& x) { return x.is_number(); });
    if (!is_point) return BadRequest("has an 'origin' that is not three numbers");
    open.cloud.origin = origin->get<WorldOrigin>();
  }
  open.cloud.Resize(count, static_cast<int>(degree));
  const std::byte* from = data.data();
  for (Buffer<float>* column :
       {&open.cloud.means, &open.cloud.log_scales, &open.cloud.quats, &open.cloud.opacity_logits, &open.cloud.sh}) {
    if (column->empty()) continue;
    std::memcpy(column->data(), from, column->size() * sizeof(float));
    from += column->size() * sizeof(float);
  }
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(open.cloud));
  return Keep(std::move(open));
}

Result<Engine::Answer> Engine::Info(const Json& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(OpenCloud* const found, FindCloud(request, "cloud"));
  SplatFindings findings = InspectSplat(found->cloud);
  findings.file = found->name;
  findings.format = found->format;
  findings.facts = found->facts;
  findings.file_bytes = found->bytes;
  Answer answer;
  answer.json = ToJson(findings);
  answer.json["looks_in_words"] = DescribeProvenance(findings);
  answer.json["treatment_in_words"] = TreatmentInWords(findings);
  return answer;
}

Result<Engine::Answer> Engine::Enhance(const Json& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenCloud* const open, FindCloud(request, "cloud"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet* const cameras, FindCameras(request));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t seed, NumberOf(request, "seed", int64_t{1} << 53));
  EnhanceFlags flags;
  ANCHORSPLAT_ASSIGN_OR_RETURN(flags.options.given, ReadWords(request, flags, cameras));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const EnhanceOptions options,
                               MakeEnhanceOptions(flags, static_cast<uint64_t>(seed), cameras));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckAddresses(open->cloud, options));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Enhanced enhanced, anchorsplat::Enhance(open->cloud, options));
  if (options.cameras && !UpOf(enhanced.cloud.comments)) {
    if (const auto up = WorldUp(options.cameras->cameras)) enhanced.cloud.comments.push_back(UpComment(*up));
  }
  const Json report = ToJson(enhanced.report);
  OpenCloud kept;
  kept.cloud = std::move(enhanced.cloud);
  Answer answer = Keep(std::move(kept));
  answer.json["report"] = report;
  return answer;
}

Result<Engine::Answer> Engine::Edit(const Json& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenCloud* const open, FindCloud(request, "cloud"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Edits edits, EditsOf(request));
  Answer answer;
  if (edits.count_only) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(answer.json["actions"], CountEdits(open->cloud, edits.actions));
    return answer;
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(Edited edited, EditCloud(open->cloud, edits.actions));
  answer = Keep({std::move(edited.cloud), open->name, open->format, {}, 0});
  answer.json.update(edited.report);
  return answer;
}

Result<Engine::Answer> Engine::Filter(const Json& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenCloud* const open, FindCloud(request, "cloud"));
  const Json* const value = Find(request, "upscale");
  const double upscale = value != nullptr && value->is_number() ? value->get<double>() : 4;
  if (!(upscale >= 1 && upscale <= 1e6)) return BadRequest("has an 'upscale' that is not from 1 to 1000000");
  const GaussianCloud& cloud = open->cloud;
  const auto reading = IsMarkedFullWidth(cloud) ? Result<Reading>(Error{}) : Read(cloud);
  const Treatment treatment = reading.ok() ? Treat(*reading, {.mode = cloud.render_mode}) : Treatment{};
  const bool none = treatment.method == TreatmentMethod::kNone;
  const double strength = none ? 0 : DefaultFilterStrength(upscale, treatment.mode);
  Answer answer;
  const double gain = double{kDilation} * (strength - ShownStrength(upscale, cloud.render_mode));
  answer.json = {{"gain", std::max(0.0, gain)}};
  return answer;
}

Result<Engine::Answer> Engine::Write(const Json& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenCloud* const open, FindCloud(request, "cloud"));
  WriteFlags flags;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto given, ReadWords(request, flags));
  ANCHORSPLAT_ASSIGN_OR_RETURN(bytes_, WriteCloudBytes(open->cloud, TextOf(request, "format"), flags.options));
  Answer answer;
  answer.blocks = {bytes_};
  return answer;
}

Result<Engine::Answer> Engine::Page(const Json& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenCloud* const after, FindCloud(request, "after"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet* const cameras, FindCameras(request));
  PageFlags flags;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto given, ReadWords(request, flags, cameras));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ViewerPage page, MakePage(flags, cameras));
  const std::string name = TextOf(request, "name");
  page.after = {&after->cloud, name.empty() ? after->name : name, {}};
  if (Find(request, "before") != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenCloud* const before, FindCloud(request, "before"));
    page.before = ViewerSplat{&before->cloud, before->name.empty() ? "before" : before->name, {}};
    if (before->bytes > 0) page.before->file_bytes = before->bytes;
  }
  LookAtSplats(page);
  OutputMemory memory;
  page.memory = &memory;
  const std::string path = "page.html";
  ANCHORSPLAT_RETURN_IF_ERROR(WriteViewerPage(path, page));
  bytes_ = std::move(memory.files.at(path));
  Answer answer;
  answer.blocks = {bytes_};
  return answer;
}

Result<Engine::Answer> Engine::Render(const Json& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenCloud* const open, FindCloud(request, "cloud"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet* const given, FindCameras(request));
  ViewFlags flags;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto words, ReadWords(request, flags, given));
  const GaussianCloud& cloud = open->cloud;
  const bool transparent = request.value("transparent", Json()) == Json(true);
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet made, MakeViews(flags, cloud, given));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet cameras, OfOneSize(std::move(made)));
  ANCHORSPLAT_ASSIGN_OR_RETURN(RenderOptions options, MakeRenderOptions(flags, cloud, cameras));
  if (transparent) options.background = {0, 0, 0};
  const size_t views = cameras.cameras.size(), channels = transparent ? 4 : 3;
  const Pinhole size = views > 0 ? cameras.cameras.front().intrinsics : Pinhole{};
  const auto plane = static_cast<uint64_t>(size.width) * static_cast<uint64_t>(size.height);
  if (views > 0 && plane > floats_.max_size() / channels / views) {
    return Error{ErrorCode::kBadArgument, Cat(views, " pictures of ", size.width, "x", size.height,
                                              " do not fit into memory: render fewer or smaller ones")};
  }
  floats_.resize(views * static_cast<size_t>(plane) * channels);
  Rasterizer rasterizer;
  RenderOutput render;
  Progress progress("render", static_cast<int64_t>(views));
  for (size_t v = 0; v < views; ++v) {
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, cameras.cameras[v], options, render));
    const std::string nothing = EmptyPictureReason(cloud, cameras.cameras[v], options, rasterizer.statistics().visible);
    if (!nothing.empty()) LogWarning(nothing);
    const Image picture = transparent ? WithAlpha(render) : std::move(render.color);
    float* const to = floats_.data() + v * static_cast<size_t>(plane) * channels;
    for (size_t c = 0; c < channels; ++c) {
      const float* const from = picture.channel(static_cast<int>(c));
      for (size_t i = 0; i < plane; ++i) to[i * channels + c] = from[i];
    }
    progress.Advance();
  }
  Answer answer;
  answer.json = {{"views", views}, {"height", size.height}, {"width", size.width}, {"channels", channels}};
  answer.blocks = {BlockOf(floats_)};
  return answer;
}

Result<Engine::Answer> Engine::Columns(const Json& request) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenCloud* const open, FindCloud(request, "cloud"));
  const GaussianCloud& cloud = open->cloud;
  Answer answer;
  answer.json = Described(cloud);
  answer.blocks = {BlockOf(cloud.means), BlockOf(cloud.log_scales), BlockOf(cloud.quats), BlockOf(cloud.opacity_logits),
                   BlockOf(cloud.sh)};
  return answer;
}

Result<Engine::Answer> Engine::ReadCameraFiles(const Json& request, std::span<const std::byte> data) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return Error{ErrorCode::kIo, "cannot create temporary files"};
  const Json* const files = Find(request, "files");
  if (files == nullptr || !files->is_array() || files->empty()) return BadRequest("has no list of 'files'");
  uint64_t at = 0;
  std::string only;
  for (const Json& file : *files) {
    if (!file.is_object()) return BadRequest("has a value in 'files' that is not an object");
    const std::string name = TextOf(file, "name");
    if (!IsPlain(name)) return BadRequest(Cat("has a file with the invalid name '", Printable(name), "'"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t bytes, NumberOf(file, "bytes", int64_t{1} << 40));
    if (static_cast<uint64_t>(bytes) > data.size() - at) return BadRequest("lists more bytes of files than it has");
    std::ofstream out(folder.path() / name, std::ios::binary);
    out.write(reinterpret_cast<const char*>(data.data() + at), static_cast<std::streamsize>(bytes));
    out.close();
    if (!out) return Error{ErrorCode::kIo, Cat(Printable(name), ": no room to write it")};
    at += static_cast<uint64_t>(bytes);
    only = name;
  }
  const std::filesystem::path path = files->size() == 1 ? folder.path() / only : folder.path();
  auto cameras = ReadCameras(path);
  if (!cameras.ok()) {  // use the caller's name instead of the temporary path
    Error error = cameras.error();
    const std::string prefix = folder.path().string() + "/";
    if (const size_t found = error.message.find(prefix); found != std::string::npos) {
      error.message.erase(found, prefix.size());
    }
    return error;
  }
  Answer answer;
  answer.json = {{"cameras", ++last_}, {"views", cameras->cameras.size()}};
  cameras_[last_] = *std::move(cameras);
  return answer;
}

Result<Engine::Answer> Engine::Release(const Json& request) {
  if (Find(request, "cloud") != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t number, NumberOf(request, "cloud", last_));
    clouds_.erase(number);
  }
  if (Find(request, "cameras") != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t number, NumberOf(request, "cameras", last_));
    cameras_.erase(number);
  }
  return Answer();
}

}  // namespace anchorsplat::web

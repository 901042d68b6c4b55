#include "viewer/page_writer.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/framing.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "core/world_up.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"
#include "render/constants.h"
#include "viewer/base64.h"
#include "viewer/html_text.h"
#include "viewer/page_files.h"
#include "viewer/page_folder.h"
#include "viewer/quantized_cloud.h"

namespace anchorsplat {
namespace {

using Json = nlohmann::ordered_json;

// Larger files are not meant for comparing by eye.
constexpr uint64_t kMaxPictureBytes = 50'000'000;

// Minimum per Gaussian: half of three means and a rotation.
constexpr uint64_t kLeastBytes = 6;

// Data in the page, found by id.
struct DataElement {
  std::string id;
  std::string base64;
};

// Safety factor of size estimates before rejecting.
constexpr double kSure = 0.85;

Error TooLarge(const std::filesystem::path& path, uint64_t bytes, const ViewerPage& page, const char* roughly = "") {
  return {ErrorCode::kBadArgument,
          Cat(path.string(), ": the page would take ", roughly, HumanBytes(bytes), ", more than the ",
              HumanBytes(page.max_bytes), " a browser opens well; ", page.smaller)};
}

// JSON for a script element from any bytes: invalid UTF-8 becomes U+FFFD, and nothing ends the element early.
std::string ScriptJson(const Json& json) {
  return EscapeJsonForScript(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

// Description of a splat for the page, without the location of its data. `origin`: that of the page's world.
Json SplatJson(const ViewerSplat& splat, const QuantizedCloud& q, const WorldOrigin& origin) {
  const Framing framing = FrameCloud(*splat.cloud);
  std::array<double, 3> center = RelativeToOrigin(splat.cloud->origin, origin);
  for (size_t k = 0; k < 3; ++k) center[k] += q.center[k];
  const Json subject = {
      {"target", RelativeToOrigin(framing.target, origin)}, {"radius", framing.radius}, {"half", framing.half}};
  const RenderMode mode = splat.cloud->render_mode.value_or(RenderMode::kClassic);
  return Json{{"name", splat.name},
              {"fileBytes", splat.file_bytes ? Json(*splat.file_bytes) : Json()},
              {"fileCount", splat.cloud->size()},
              {"count", q.count},
              {"degree", q.sh_degree},
              {"fileDegree", splat.cloud->sh_degree},
              {"mode", NameOf(mode)},
              {"compensated", IsCompensated(mode)},
              {"dilation", DilationOf(mode)},
              {"center", center},
              {"radius", q.radius},
              {"spread", q.spread},
              {"reach", q.reach},
              {"subject", subject},
              {"logScale", q.log_scale},
              {"dc", q.dc},
              {"shMax", q.sh_max},
              {"meanBits", kMeanBits},
              {"scalarBits", kScalarBits},
              {"harmonicTop", kHarmonicTop},
              {"pieceBytes", kPieceBytes},
              {"planes", PlanesPerGaussian(q.sh_degree)}};
}

// Adds a splat: its data go to `folder` if set, else to `elements`.
Result<Json> AddSplat(const ViewerSplat& splat, const WorldOrigin& origin, const std::string& id, int max_sh_degree,
                      std::vector<DataElement>& elements, PageFolder* folder = nullptr) {
  if (splat.cloud == nullptr) return Error{ErrorCode::kBadArgument, Cat("no cloud to show as \"", id, "\"")};
  auto measured = MeasureCloud(*splat.cloud, max_sh_degree);
  if (!measured.ok()) {
    return Error{measured.error().code, Cat(Printable(splat.name), ": ", measured.error().message)};
  }
  Json json = SplatJson(splat, measured->scale, origin);
  if (folder != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(json["parts"], folder->AddSplat(*splat.cloud, *std::move(measured), id));
    return json;
  }
  const std::vector<uint8_t> planes = PlanesOf(*splat.cloud, measured->scale, measured->rows);
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<std::string> texts, PackPlanes(planes));
  Json ids = Json::array();
  for (size_t k = 0; k < texts.size(); ++k) {
    elements.push_back({Cat(id, "-", k), std::move(texts[k])});
    ids.push_back(elements.back().id);
  }
  json["pieces"] = std::move(ids);
  return json;
}

// Embeds a picture. Its first bytes determine the MIME type.
Result<Json> AddPicture(const std::filesystem::path& path, const std::string& id, std::vector<DataElement>& elements) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path, kMaxPictureBytes));
  const std::string_view head = std::string_view(bytes).substr(0, 12);
  std::string type;
  if (head.starts_with("\x89PNG\r\n\x1a\n")) type = "image/png";
  if (head.starts_with("\xff\xd8\xff")) type = "image/jpeg";
  if (head.starts_with("RIFF") && head.ends_with("WEBP")) type = "image/webp";
  if (type.empty()) {
    return Error{ErrorCode::kBadFile,
                 Cat(path.string(), ": browsers show PNG, JPEG and WebP; convert it to one of these")};
  }
  elements.push_back({id, Base64({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()})});
  return Json{{"type", type}, {"element", id}};
}

Result<Json> AddView(const ViewerView& view, const WorldOrigin& origin, size_t index,
                     std::vector<DataElement>& elements) {
  const Pinhole& k = view.camera.intrinsics;
  const Pose pose = RelativeToOrigin(view.camera.world_to_camera, origin);
  Json picture;
  if (!view.picture.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(picture, AddPicture(view.picture, Cat("picture-", index), elements));
  }
  return Json{{"name", view.camera.name},
              {"width", k.width},
              {"height", k.height},
              {"fx", k.fx},
              {"fy", k.fy},
              {"cx", k.cx},
              {"cy", k.cy},
              {"rotation", pose.rotation},
              {"translation", pose.translation},
              {"picture", std::move(picture)}};
}

// Up of the page's cameras, else as the splat states.
std::array<double, 3> WorldUpOf(const ViewerPage& page) {
  std::vector<Camera> cameras;
  for (const ViewerView& view : page.views) cameras.push_back(view.camera);
  if (const auto up = WorldUp(cameras)) return *up;
  if (const auto up = UpOf(page.after.cloud->comments)) return *up;
  return (page.before ? UpOf(page.before->cloud->comments) : std::nullopt).value_or(kUsualUp);
}

// Credits of both splats, each once.
std::vector<std::string> AllCredits(const ViewerPage& page) {
  std::vector<std::string> credits = CreditsOf(page.after.cloud->comments);
  if (!page.before) return credits;
  for (std::string& credit : CreditsOf(page.before->cloud->comments)) {
    if (std::find(credits.begin(), credits.end(), credit) == credits.end()) credits.push_back(std::move(credit));
  }
  return credits;
}

// Replaces the single occurrence of `mark`, which our template contains.
void Substitute(std::string& text, std::string_view mark, std::string_view value) {
  text.replace(text.find(mark), mark.size(), value);
}

std::string InlineScripts() {
  std::string out;
  for (const char* name :
       {"payload.js", "camera.js", "shaders.js", "pictures.js", "renderer.js", "box.js", "interface.js", "app.js"}) {
    out += Cat("<script>\n", PageFile(name), "</script>\n");
  }
  return out;
}

}  // namespace

double MostPageBytes(int sh_degree) { return PlanesPerGaussian(sh_degree) * 4.0 / 3; }

uint64_t EstimatedPageBytes(const GaussianCloud& cloud, int max_sh_degree) {
  constexpr int64_t kSample = 1 << 16;
  const int64_t step = std::max<int64_t>(1, cloud.size() / kSample);
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < cloud.size(); i += step) rows.push_back(i);
  const Result<GaussianCloud> sample = Subset(cloud, rows);
  if (!sample.ok()) return 0;
  ViewerSplat splat;
  splat.cloud = &*sample;
  std::vector<DataElement> elements;
  if (rows.empty() || !AddSplat(splat, sample->origin, "sample", max_sh_degree, elements).ok()) return 0;
  double bytes = 0;
  for (const DataElement& element : elements) bytes += static_cast<double>(element.base64.size());
  return static_cast<uint64_t>(bytes * static_cast<double>(cloud.size()) / static_cast<double>(rows.size()));
}

Status CheckPageSize(const std::filesystem::path& path, const ViewerPage& page) {
  if (page.folder) return {};
  // Rejects early what is certainly too large: means and rotations never deflate below half.
  uint64_t at_least = static_cast<uint64_t>(page.after.cloud == nullptr ? 0 : page.after.cloud->size());
  if (page.before && page.before->cloud != nullptr) at_least += static_cast<uint64_t>(page.before->cloud->size());
  at_least *= kLeastBytes;
  if (at_least > page.max_bytes) return TooLarge(path, at_least, page);
  // Rejects by a sample, which is far faster than compressing everything.
  const GaussianCloud* const both[] = {page.after.cloud, page.before ? page.before->cloud : nullptr};
  double most = 0;
  for (const GaussianCloud* cloud : both) {
    if (cloud == nullptr) continue;
    most += static_cast<double>(cloud->size()) * MostPageBytes(std::min(cloud->sh_degree, page.max_sh_degree));
  }
  uint64_t estimated = 0;
  for (const GaussianCloud* cloud : both) {
    if (cloud == nullptr || most <= static_cast<double>(page.max_bytes)) continue;
    estimated += EstimatedPageBytes(*cloud, page.max_sh_degree);
  }
  if (kSure * static_cast<double>(estimated) > static_cast<double>(page.max_bytes)) {
    return TooLarge(path, estimated, page, "about ");
  }
  return {};
}

Status WriteViewerPage(const std::filesystem::path& path, const ViewerPage& page, const WriteOptions& options) {
  if (page.pixel_size && !(std::isfinite(*page.pixel_size) && *page.pixel_size > 0)) {
    return Error{ErrorCode::kBadArgument, "the training pixel size must be positive and finite"};
  }
  if (!page.own_page.empty() && !page.own_page.starts_with("https://") && !page.own_page.starts_with("http://")) {
    return Error{ErrorCode::kBadArgument, Cat("the page where readers open a splat of their own: '",
                                              Printable(page.own_page), "' is no address, expected https://…")};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckPageSize(path, page));
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, page.memory));
  std::vector<DataElement> elements;
  std::optional<PageFolder> folder;
  if (page.folder) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(PageFolder made, PageFolder::Create(path, page.memory));
    folder.emplace(std::move(made));
  }
  PageFolder* const data = folder ? &*folder : nullptr;
  const WorldOrigin origin = page.after.cloud == nullptr ? WorldOrigin{} : page.after.cloud->origin;
  ANCHORSPLAT_ASSIGN_OR_RETURN(Json after, AddSplat(page.after, origin, "after", page.max_sh_degree, elements, data));
  Json before;
  if (page.before) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(before, AddSplat(*page.before, origin, "before", page.max_sh_degree, elements, data));
  }
  Json views = Json::array();
  for (size_t k = 0; k < page.views.size(); ++k) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(Json view, AddView(page.views[k], origin, k, elements));
    views.push_back(std::move(view));
  }
  const std::string& title = page.title.empty() ? page.after.name : page.title;
  const Json description = {{"title", title},
                            {"after", std::move(after)},
                            {"before", std::move(before)},
                            {"views", std::move(views)},
                            {"pixelSize", page.pixel_size ? Json(*page.pixel_size) : Json()},
                            {"ownPage", page.own_page.empty() ? Json() : Json(page.own_page)},
                            {"background", page.background},
                            {"up", WorldUpOf(page)},
                            {"credits", AllCredits(page)},
                            // The page uses the rasterizer's constants.
                            {"constants",
                             {{"minAlpha", kMinAlpha},
                              {"maxAlpha", kMaxAlpha},
                              {"near", kNear},
                              {"nearShare", kNearShare},
                              {"frustumMargin", kFrustumMargin}}}};

  std::string head(PageFile("page.html"));
  const std::string end = head.substr(head.find("{{data}}") + std::string_view("{{data}}").size());
  head.resize(head.find("{{data}}"));
  // Allows scripts beside the page, from disk or server.
  Substitute(head, "{{scripts}}", page.folder ? " 'self' file:" : "");
  Substitute(head, "{{style}}", PageFile("page.css"));
  // JSON's replacement of invalid UTF-8 serves the title too.
  const std::string printable_title = Json::parse(Json(title).dump(-1, ' ', false, Json::error_handler_t::replace));
  Substitute(head, "{{title}}", EscapeHtml(printable_title));
  const std::string tail = Cat("<script type=\"application/json\" id=\"description\">", ScriptJson(description),
                               "</script>\n", "<script type=\"text/plain\" id=\"worker-source\">\n",
                               PageFile("worker.js"), "</script>\n", InlineScripts(), end);

  uint64_t bytes = head.size() + tail.size();
  for (const DataElement& element : elements) bytes += element.base64.size() + element.id.size() + 50;
  if (bytes > page.max_bytes) return TooLarge(path, bytes, page);

  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(head));
  for (const DataElement& element : elements) {
    ANCHORSPLAT_RETURN_IF_ERROR(file.Write(Cat("<script type=\"text/plain\" id=\"", element.id, "\">")));
    ANCHORSPLAT_RETURN_IF_ERROR(file.Write(element.base64));
    ANCHORSPLAT_RETURN_IF_ERROR(file.Write("</script>\n"));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(tail));
  if (!folder) return file.Commit();
  ANCHORSPLAT_RETURN_IF_ERROR(folder->Publish());
  ANCHORSPLAT_RETURN_IF_ERROR(file.Commit());
  folder->Keep(options.overwrite);
  return {};
}

}  // namespace anchorsplat

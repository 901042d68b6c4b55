#include "cameras/metashape_cameras.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <set>
#include <vector>

#include "cameras/camera_checks.h"
#include "cameras/lensed_pinhole.h"
#include "cameras/picture_search.h"
#include "core/log.h"
#include "core/number_text.h"
#include "core/rotation.h"
#include "core/text.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

constexpr size_t kMostXmlBytes = size_t{256} << 20;
// Limit on "<" and "=" characters, which bounds elements and attributes of the parsed tree and thus its memory.
constexpr int64_t kMostMarks = int64_t{1} << 23;
constexpr int kDeepestGroup = 64;

// XML access with errors that name file and line.
class XmlText {
 public:
  XmlText(const std::string& name, std::string_view bytes) : name_(name), bytes_(bytes) {}

  Error Complain(ptrdiff_t offset, const std::string& sentence) const {
    if (offset < 0) return Error{ErrorCode::kBadFile, Cat(name_, ": ", sentence)};
    const auto end = bytes_.begin() + std::min(offset, std::ssize(bytes_));
    return Error{ErrorCode::kBadFile, Cat(name_, ": line ", 1 + std::count(bytes_.begin(), end, '\n'), ": ", sentence)};
  }
  Error Complain(const pugi::xml_node& node, const std::string& sentence) const {
    return Complain(node.offset_debug(), Cat("<", Printable(node.name()), ">: ", sentence));
  }
  const std::string& name() const { return name_; }

 private:
  const std::string& name_;
  std::string_view bytes_;
};

bool IsXmlSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

// The numbers in an element's text.
Result<std::vector<double>> NumbersOf(const XmlText& xml, const pugi::xml_node& node, size_t count) {
  std::string_view text = node.child_value();
  std::vector<double> numbers;
  while (true) {
    while (!text.empty() && IsXmlSpace(text.front())) text.remove_prefix(1);
    if (text.empty()) break;
    size_t size = 0;
    while (size < text.size() && !IsXmlSpace(text[size])) ++size;
    const std::string_view word = text.substr(0, size);
    double number = 0;
    const auto [end, code] = FromChars(word.data(), word.data() + word.size(), number);
    if (code != std::errc() || end != word.data() + word.size() || !std::isfinite(number)) {
      return xml.Complain(node, Cat("expected a number, found \"", Printable(std::string(word)), "\""));
    }
    if (numbers.size() < count) numbers.push_back(number);
    if (++size > text.size()) size = text.size();
    text.remove_prefix(size);
    if (numbers.size() == count && text.find_first_not_of(" \t\r\n") != std::string_view::npos) {
      return xml.Complain(node, Cat("expected ", count, " numbers, found more"));
    }
  }
  if (numbers.size() != count) return xml.Complain(node, Cat("expected ", count, " numbers, found ", numbers.size()));
  return numbers;
}

// Number in a child element; `missing` if absent.
Result<double> NumberOf(const XmlText& xml, const pugi::xml_node& parent, const char* child, double missing) {
  const pugi::xml_node node = parent.child(child);
  if (!node) return missing;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> numbers, NumbersOf(xml, node, 1));
  return numbers[0];
}

// Nearest rotation to nine numbers of a rounded one.
Result<std::array<double, 9>> RotationOf(const XmlText& xml, const pugi::xml_node& node,
                                         const std::array<double, 9>& numbers) {
  const auto pose = PoseFromCameraToWorld(numbers, {0, 0, 0});
  if (!pose.ok()) return xml.Complain(node, pose.error().message);
  return NearestRotation(numbers);
}

// <rotation>, <translation> and <scale> of a component or chunk; none without <transform>.
Result<std::optional<Similarity>> TransformOf(const XmlText& xml, const pugi::xml_node& owner) {
  const pugi::xml_node transform = owner.child("transform");
  if (!transform || !transform.first_child()) return std::optional<Similarity>();
  Similarity placed;
  if (const pugi::xml_node rotation = transform.child("rotation")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> r, NumbersOf(xml, rotation, 9));
    std::copy(r.begin(), r.end(), placed.rotation.begin());
    ANCHORSPLAT_ASSIGN_OR_RETURN(placed.rotation, RotationOf(xml, rotation, placed.rotation));
  }
  if (const pugi::xml_node translation = transform.child("translation")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> t, NumbersOf(xml, translation, 3));
    std::copy(t.begin(), t.end(), placed.translation.begin());
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(placed.scale, NumberOf(xml, transform, "scale", 1));
  if (!(placed.scale > 0)) return xml.Complain(transform, Cat("scale ", placed.scale, ", expected a positive number"));
  if (!transform.child("rotation") && !transform.child("translation") && !transform.child("scale")) {
    return xml.Complain(transform, "expected a rotation, a translation and a scale");
  }
  return std::optional(placed);
}

Result<int> SideOf(const XmlText& xml, const pugi::xml_node& resolution, const char* name) {
  const std::string_view text = resolution.attribute(name).value();
  int side = 0;
  const auto [end, code] = FromChars(text.data(), text.data() + text.size(), side);
  if (code != std::errc() || end != text.data() + text.size() || side < 1 || side > kMaxImageSide) {
    return xml.Complain(resolution, Cat("expected a ", name, " from 1 to ", kMaxImageSide, ", found \"",
                                        Printable(std::string(text)), "\""));
  }
  return side;
}

// The adjusted calibration, else the first one.
pugi::xml_node CalibrationOf(const pugi::xml_node& sensor) {
  pugi::xml_node chosen = sensor.child("calibration");
  for (const pugi::xml_node calibration : sensor.children("calibration")) {
    if (std::string_view(calibration.attribute("class").value()) == "adjusted") chosen = calibration;
  }
  return chosen;
}

Result<LensedPinhole> SensorOf(const XmlText& xml, const pugi::xml_node& sensor) {
  const pugi::xml_node calibration = CalibrationOf(sensor);
  std::string type = calibration.attribute("type").value();
  if (type.empty()) type = sensor.attribute("type").value();
  if (type != "frame" && type != "fisheye" && !type.empty()) {
    return xml.Complain(sensor,
                        Cat("sensor type ", Printable(type),
                            " is not supported (frame and fisheye are); convert its pictures to frame cameras first"));
  }
  if (!calibration) {
    return xml.Complain(sensor, "has no calibration; align the photos in Metashape and export the cameras again");
  }
  pugi::xml_node resolution = calibration.child("resolution");
  if (!resolution) resolution = sensor.child("resolution");
  if (!resolution) return xml.Complain(sensor, "has no resolution");
  Pinhole c;
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.width, SideOf(xml, resolution, "width"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.height, SideOf(xml, resolution, "height"));
  if (!calibration.child("f")) {
    return xml.Complain(calibration,
                        calibration.child("fx")
                            ? "has fx and fy, as written by PhotoScan before 1.2; export the cameras with a "
                              "newer version"
                            : "has no focal length <f>");
  }
  std::map<std::string_view, double> number;
  for (const char* name : {"f", "cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4"}) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(number[name], NumberOf(xml, calibration, name, 0));
  }
  c.fx = number["f"] + number["b1"];
  c.fy = number["f"];
  c.cx = 0.5 * c.width + number["cx"];
  c.cy = 0.5 * c.height + number["cy"];
  Lens lens{.model = type == "fisheye" ? LensModel::kFisheye : LensModel::kRadial,
            .radial = {number["k1"], number["k2"], number["k3"], number["k4"]},
            .tangential = {number["p2"], number["p1"]},
            .skew = number["b2"] / c.fx};
  for (const char* name : {"p1", "p2", "p3", "p4"}) {
    const bool known = lens.model == LensModel::kRadial && name[1] < '3';
    if (known || number[name] == 0) continue;
    return xml.Complain(calibration, Cat(name, " = ", number[name], " is not supported for a ",
                                         lens.model == LensModel::kRadial ? "frame" : "fisheye",
                                         " lens; fix it at 0 in Metashape and optimize the cameras again"));
  }
  auto through = ThroughLens(lens, c);
  if (!through.ok()) return xml.Complain(calibration, through.error().message);
  return through;
}

// Camera elements of a chunk, including those in groups.
Status CollectCameras(const XmlText& xml, const pugi::xml_node& parent, int depth, std::vector<pugi::xml_node>& out) {
  if (depth > kDeepestGroup) return xml.Complain(parent, Cat("groups are nested deeper than ", kDeepestGroup));
  for (const pugi::xml_node child : parent.children()) {
    const std::string_view kind = child.name();
    if (kind == "camera") out.push_back(child);
    if (kind == "group") ANCHORSPLAT_RETURN_IF_ERROR(CollectCameras(xml, child, depth + 1, out));
  }
  return {};
}

struct MetashapeChunk {
  pugi::xml_node node;
  std::string label;
  std::vector<pugi::xml_node> aligned;
  int64_t disabled = 0, not_aligned = 0;
};

Result<MetashapeChunk> ChunkOf(const XmlText& xml, const pugi::xml_node& node) {
  MetashapeChunk chunk{node, node.attribute("label").value(), {}};
  std::vector<pugi::xml_node> all;
  for (const pugi::xml_node cameras : node.children("cameras")) {
    ANCHORSPLAT_RETURN_IF_ERROR(CollectCameras(xml, cameras, 0, all));
  }
  for (const pugi::xml_node& camera : all) {
    if (!camera.attribute("enabled").as_bool(true)) {
      ++chunk.disabled;
    } else if (!camera.child("transform")) {
      ++chunk.not_aligned;
    } else {
      chunk.aligned.push_back(camera);
    }
  }
  return chunk;
}

std::string Named(const char* kind, const std::string& label) {
  return label.empty() ? Cat("a ", kind, " without a label") : Cat(kind, " \"", Printable(label), "\"");
}

// Components without a transform have separate worlds: only the largest is kept.
void KeepOneWorld(const XmlText& xml, const std::map<std::string, Similarity>& placed, MetashapeChunk& chunk) {
  std::map<std::string, size_t> cameras_of;
  for (const pugi::xml_node& camera : chunk.aligned) ++cameras_of[camera.attribute("component_id").value()];
  const bool all_placed =
      std::ranges::all_of(cameras_of, [&](const auto& component) { return placed.contains(component.first); });
  if (cameras_of.size() < 2 || all_placed) return;
  const auto largest = std::ranges::max_element(cameras_of, {}, [](const auto& component) { return component.second; });
  const std::string kept = largest->first;
  LogWarning(
      Cat(xml.name(), ": ", chunk.aligned.size() - largest->second, " of ", chunk.aligned.size(),
          " aligned cameras skipped: their components have no known position relative to the largest one. Merge the "
          "components in Metashape to use all cameras"));
  std::erase_if(chunk.aligned, [&](const auto& camera) { return camera.attribute("component_id").value() != kept; });
}

Result<Pose> PoseOf(const XmlText& xml, const pugi::xml_node& camera, const Similarity& placed) {
  const pugi::xml_node transform = camera.child("transform");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> m, NumbersOf(xml, transform, 16));
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) return xml.Complain(transform, "last row is not 0 0 0 1");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto rotation,
                               RotationOf(xml, transform, {m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Pose pose, PoseFromCameraToWorld(rotation, {m[3], m[7], m[11]}));
  const Pose world = Moved(pose, placed);
  for (const double x : world.translation) {
    if (!std::isfinite(x)) return xml.Complain(transform, "the camera's place in the world is not finite");
  }
  return world;
}

// Counts of the other cameras, for a message.
void SayWhatIsLeftOut(const XmlText& xml, const std::vector<MetashapeChunk>& chunks, const MetashapeChunk& taken) {
  if (taken.not_aligned > 0) {
    LogWarning(Cat(xml.name(), ": ", taken.not_aligned, " of ",
                   std::ssize(taken.aligned) + taken.not_aligned + taken.disabled, " cameras skipped: not aligned"));
  }
  if (taken.disabled > 0) LogInfo(Cat(xml.name(), ": ", taken.disabled, " cameras skipped: disabled"));
  for (const MetashapeChunk& chunk : chunks) {
    if (chunk.node == taken.node || chunk.aligned.empty()) continue;
    LogWarning(Cat(xml.name(), ": ", chunk.aligned.size(), " cameras of ", Named("chunk", chunk.label),
                   " skipped: using ", Named("chunk", taken.label), ", which has ", taken.aligned.size(),
                   ". Merge the chunks in Metashape, or export each one separately"));
  }
}

Result<CameraSet> CamerasOfChunk(const XmlText& xml, const std::vector<MetashapeChunk>& chunks, MetashapeChunk chunk,
                                 const std::filesystem::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::optional<Similarity> of_chunk, TransformOf(xml, chunk.node));
  std::map<std::string, Similarity> placed;  // transforms of components, by id
  for (const pugi::xml_node component : chunk.node.child("components").children("component")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::optional<Similarity> transform, TransformOf(xml, component));
    if (transform) placed[component.attribute("id").value()] = *transform;
  }
  SayWhatIsLeftOut(xml, chunks, chunk);
  KeepOneWorld(xml, placed, chunk);

  std::map<std::string, pugi::xml_node> sensors;
  for (const pugi::xml_node sensor : chunk.node.child("sensors").children("sensor")) {
    sensors.emplace(sensor.attribute("id").value(), sensor);
  }
  std::map<std::string, LensedPinhole> known;
  CameraSet set;
  for (const pugi::xml_node& node : chunk.aligned) {
    const std::string label = node.attribute("label").value(), sensor_id = node.attribute("sensor_id").value();
    if (ViewName(label).empty()) return xml.Complain(node, "has no label; expected the name of its picture");
    if (!known.contains(sensor_id)) {
      const auto sensor = sensors.find(sensor_id);
      if (sensor == sensors.end()) {
        return xml.Complain(node, Cat("its sensor \"", Printable(sensor_id), "\" is not in the list of sensors"));
      }
      ANCHORSPLAT_ASSIGN_OR_RETURN(known[sensor_id], SensorOf(xml, sensor->second));
    }
    const LensedPinhole& lensed = known[sensor_id];
    const auto component = placed.find(node.attribute("component_id").value());
    const Similarity world = component != placed.end() ? component->second : of_chunk.value_or(Similarity());
    ANCHORSPLAT_ASSIGN_OR_RETURN(Pose pose, PoseOf(xml, node, world));
    set.cameras.push_back({ViewName(label), label, lensed.undistorted, std::move(pose), lensed.photograph});
  }
  FindPicturesOf({.folders = FoldersOfPictures(folder), .project = folder}, set.cameras);
  return set;
}

}  // namespace

bool LooksLikeMetashape(std::string_view head) {
  const size_t document = head.find("<document");
  return document != std::string_view::npos && head.find("<chunk", document) != std::string_view::npos;
}

Result<CameraSet> CamerasFromMetashape(const std::string& name, std::string_view bytes,
                                       const std::filesystem::path& folder) {
  const XmlText xml(name, bytes);
  if (bytes.size() > kMostXmlBytes) return xml.Complain(-1, "is larger than 256 MiB, too large for a camera file");
  if (std::ranges::count_if(bytes, [](char c) { return c == '<' || c == '='; }) > kMostMarks) {
    return xml.Complain(-1, Cat("has more than ", WithThousands(kMostMarks), " elements and attributes"));
  }
  // Without a DTD: the parser does not support custom entities.
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(bytes.data(), bytes.size(), pugi::parse_minimal | pugi::parse_escapes | pugi::parse_eol);
  if (!parsed) return xml.Complain(parsed.offset, Cat("not XML: ", parsed.description()));
  std::vector<MetashapeChunk> chunks;
  for (const pugi::xml_node node : document.child("document").children("chunk")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(MetashapeChunk chunk, ChunkOf(xml, node));
    chunks.push_back(std::move(chunk));
  }
  if (chunks.empty()) {
    return xml.Complain(
        -1,
        "is an XML file without a chunk: expected cameras exported by Metashape (File > Export > Export "
        "Cameras, Agisoft XML)");
  }
  const auto largest = std::ranges::max_element(chunks, {}, [](const auto& chunk) { return chunk.aligned.size(); });
  if (largest->aligned.empty()) {
    return xml.Complain(-1, Cat("none of its ", largest->not_aligned + largest->disabled,
                                " cameras is enabled and aligned; align the photos in Metashape and export the cameras "
                                "again"));
  }
  return CamerasOfChunk(xml, chunks, *largest, folder);
}

}  // namespace anchorsplat

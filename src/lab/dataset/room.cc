#include "dataset/room.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <sstream>

#include "core/log.h"
#include "core/random.h"
#include "core/text.h"
#include "core/vector3.h"
#include "dataset/dataset_split.h"
#include "dataset/room_pictures.h"
#include "io/file_bytes.h"
#include "scene/mesh_reader.h"

namespace anchorsplat {

namespace {

using Point = std::array<float, 3>;

constexpr double kFieldOfView = 75;
constexpr double kFromFurniture = 0.15, kFromWalls = 0.35;  // minimum distance of cameras, metres
// The window, and the depth of its reveal.
constexpr float kWindowLeft = 1.7f, kWindowRight = 3.5f, kSill = 0.9f, kLintel = 2.2f, kReveal = 0.15f;

// Part of a picture shown on a panel, in repeats.
struct Part {
  float u0 = 0, v0 = 0, u1 = 1, v1 = 1;
};

class Builder {
 public:
  explicit Builder(Mesh& mesh) : mesh_(mesh) {}

  int32_t AddMaterial(const std::string& name, const Point& color, std::optional<Texture> picture, bool lit = false) {
    Material material;
    material.name = name;
    material.diffuse = color;
    material.lit = lit;
    if (picture) {
      material.texture = static_cast<int>(mesh_.textures.size());
      mesh_.textures.push_back(*std::move(picture));
    }
    mesh_.materials.push_back(std::move(material));
    return static_cast<int32_t>(mesh_.materials.size()) - 1;
  }

  // Adds a parallelogram with normal right × up.
  void AddPanel(const Point& corner, const Point& right, const Point& up, int32_t material, const Part& part = {}) {
    const uint32_t first = static_cast<uint32_t>(mesh_.positions.size());
    for (const auto& [s, t] : {std::array<float, 2>{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
      Point p;
      for (size_t k = 0; k < 3; ++k) p[k] = corner[k] + s * right[k] + t * up[k];
      mesh_.positions.push_back(p);
      mesh_.normals.push_back({0, 0, 0});  // flat
      mesh_.uvs.push_back({part.u0 + s * (part.u1 - part.u0), part.v0 + t * (part.v1 - part.v0)});
      mesh_.colors.push_back({1, 1, 1, 1});
    }
    mesh_.triangles.push_back({first, first + 1, first + 2});
    mesh_.triangles.push_back({first, first + 2, first + 3});
    mesh_.triangle_materials.insert(mesh_.triangle_materials.end(), {material, material});
  }

  void AddBox(const Point& low, const Point& high, int32_t material) {
    const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    AddPanel({low[0], low[1], high[2]}, {x, 0, 0}, {0, y, 0}, material);
    AddPanel({high[0], low[1], low[2]}, {-x, 0, 0}, {0, y, 0}, material);
    AddPanel({high[0], low[1], high[2]}, {0, 0, -z}, {0, y, 0}, material);
    AddPanel({low[0], low[1], low[2]}, {0, 0, z}, {0, y, 0}, material);
    AddPanel({low[0], high[1], high[2]}, {x, 0, 0}, {0, 0, -z}, material);
    AddPanel({low[0], low[1], low[2]}, {x, 0, 0}, {0, 0, z}, material);
  }

 private:
  Mesh& mesh_;
};

// Appends `from` to `to`, which has all arrays.
void Append(Mesh from, Mesh& to) {
  const size_t count = from.positions.size();
  from.normals.resize(count, {0, 0, 0});
  from.uvs.resize(count, {0, 0});
  from.colors.resize(count, {1, 1, 1, 1});
  const uint32_t first = static_cast<uint32_t>(to.positions.size());
  const int32_t materials = static_cast<int32_t>(to.materials.size());
  const int textures = static_cast<int>(to.textures.size());
  to.positions.insert(to.positions.end(), from.positions.begin(), from.positions.end());
  to.normals.insert(to.normals.end(), from.normals.begin(), from.normals.end());
  to.uvs.insert(to.uvs.end(), from.uvs.begin(), from.uvs.end());
  to.colors.insert(to.colors.end(), from.colors.begin(), from.colors.end());
  for (const auto& t : from.triangles) to.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  for (const int32_t m : from.triangle_materials) to.triangle_materials.push_back(materials + m);
  for (Material& m : from.materials) {
    if (m.texture >= 0) m.texture += textures;
    to.materials.push_back(std::move(m));
  }
  for (Texture& t : from.textures) to.textures.push_back(std::move(t));
}

Room::Box BoxOf(const Mesh& mesh) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  Room::Box box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t corner : triangle) {
      for (size_t k = 0; k < 3; ++k) {
        box.low[k] = std::min(box.low[k], mesh.positions[corner][k]);
        box.high[k] = std::max(box.high[k], mesh.positions[corner][k]);
      }
    }
  }
  return box;
}

Status Place(const PlacedMesh& piece, Room& room) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ImportedMesh imported, ReadMesh(piece.mesh));
  for (const std::string& warning : imported.warnings) LogWarning(Cat(piece.mesh, ": ", warning));
  Mesh& mesh = imported.mesh;
  DropInvisibleTriangles(mesh);
  const Room::Box own = BoxOf(mesh);
  if (!(own.high[1] > own.low[1])) {
    return Error{ErrorCode::kBadArgument,
                 Cat(piece.mesh, ": has no height, so it cannot be scaled to ", piece.height, " m")};
  }
  const double scale = piece.height / (double{own.high[1]} - own.low[1]);
  const double angle = piece.turn * std::numbers::pi / 180, cosine = std::cos(angle), sine = std::sin(angle);
  const auto turned = [&](const Point& p) -> Point {
    return {static_cast<float>(cosine * p[0] + sine * p[2]), p[1], static_cast<float>(cosine * p[2] - sine * p[0])};
  };
  for (Point& p : mesh.positions) {
    p = turned({p[0] - 0.5f * (own.low[0] + own.high[0]), p[1] - own.low[1], p[2] - 0.5f * (own.low[2] + own.high[2])});
    for (size_t k = 0; k < 3; ++k) p[k] = static_cast<float>(scale * p[k] + piece.at[k]);
  }
  for (Point& n : mesh.normals) n = turned(n);
  const Room::Box box = BoxOf(mesh);
  for (size_t k = 0; k < 3; ++k) {
    if (box.low[k] < -1e-3f || box.high[k] > static_cast<float>(room.size[k]) + 1e-3f) {
      return Error{ErrorCode::kBadArgument, Cat(piece.mesh, ": reaches from ", box.low[k], " to ", box.high[k],
                                                " m along ", "xyz"[k], ", but the room from 0 to ", room.size[k])};
    }
  }
  room.furniture.push_back(box);
  Append(std::move(mesh), room.mesh);
  return {};
}

void BuildShell(const RoomOptions& options, Builder& build) {
  const auto w = static_cast<float>(options.size[0]), h = static_cast<float>(options.size[1]);
  const auto d = static_cast<float>(options.size[2]);
  const uint64_t seed = options.seed * 100;
  const Point white = {1, 1, 1};
  const int32_t paper = build.AddMaterial("wallpaper", white, WallpaperPicture(seed));
  const int32_t floor = build.AddMaterial("floor", white, WoodFloorPicture(seed + 10));
  const int32_t plaster = build.AddMaterial("ceiling", white, PlasterPicture(seed + 20));
  constexpr float kPaper = 0.5f, kPlanks = 2.4f;  // size of a repeat, metres
  build.AddPanel({0, 0, d}, {w, 0, 0}, {0, 0, -d}, floor, {0, 0, w / kPlanks, d / kPlanks});
  build.AddPanel({0, h, 0}, {w, 0, 0}, {0, 0, d}, plaster, {0, 0, w, d});
  build.AddPanel({w, 0, d}, {-w, 0, 0}, {0, h, 0}, paper, {0, 0, w / kPaper, h / kPaper});
  build.AddPanel({0, 0, d}, {0, 0, -d}, {0, h, 0}, paper, {0, 0, d / kPaper, h / kPaper});
  build.AddPanel({w, 0, 0}, {0, 0, d}, {0, h, 0}, paper, {0, 0, d / kPaper, h / kPaper});
  // The wall around the window.
  const auto north = [&](float x0, float y0, float x1, float y1) {
    build.AddPanel({x0, y0, 0}, {x1 - x0, 0, 0}, {0, y1 - y0, 0}, paper,
                   {x0 / kPaper, y0 / kPaper, x1 / kPaper, y1 / kPaper});
  };
  north(0, 0, kWindowLeft, h);
  north(kWindowRight, 0, w, h);
  north(kWindowLeft, 0, kWindowRight, kSill);
  north(kWindowLeft, kLintel, kWindowRight, h);
}

void BuildWindow(const RoomOptions& options, Builder& build) {
  const int32_t frame = build.AddMaterial("window frame", {0.82f, 0.81f, 0.78f}, std::nullopt, true);
  const int32_t reveal = build.AddMaterial("reveal", {0.70f, 0.69f, 0.66f}, std::nullopt, true);
  const int32_t outdoors = build.AddMaterial("outdoors", {1, 1, 1}, OutdoorsPicture(options.seed * 100 + 30), true);
  constexpr float kWide = kWindowRight - kWindowLeft, kHigh = kLintel - kSill;
  build.AddPanel({kWindowLeft, kSill, 0}, {kWide, 0, 0}, {0, 0, -kReveal}, reveal);
  build.AddPanel({kWindowLeft, kLintel, -kReveal}, {kWide, 0, 0}, {0, 0, kReveal}, reveal);
  build.AddPanel({kWindowLeft, kSill, 0}, {0, 0, -kReveal}, {0, kHigh, 0}, reveal);
  build.AddPanel({kWindowRight, kSill, -kReveal}, {0, 0, kReveal}, {0, kHigh, 0}, reveal);
  constexpr float kBar = 0.05f, kNear = -0.06f, kBack = -0.11f;
  for (const float x : {kWindowLeft, 0.5f * (kWindowLeft + kWindowRight - kBar), kWindowRight - kBar}) {
    build.AddBox({x, kSill, kBack}, {x + kBar, kLintel, kNear}, frame);
  }
  for (const float y : {kSill, kSill + 0.65f * kHigh, kLintel - kBar}) {
    build.AddBox({kWindowLeft, y, kBack + 0.005f}, {kWindowRight, y + kBar, kNear - 0.005f}, frame);
  }
  build.AddPanel({-9.4f, -4.5f, -3.2f}, {24, 0, 0}, {0, 12, 0}, outdoors);
}

void BuildCurtains(uint64_t seed, Builder& build) {
  const int32_t cloth = build.AddMaterial("curtain", {1, 1, 1}, CurtainPicture(seed));
  constexpr int kStrips = 48;
  for (const float left : {kWindowLeft - 0.5f, kWindowRight}) {
    const auto at = [&](int i) -> Point {
      const float s = static_cast<float>(i) / kStrips;
      return {left + 0.5f * s, 0.35f, 0.08f + 0.035f * std::sin(s * 10 * std::numbers::pi_v<float>)};
    };
    for (int i = 0; i < kStrips; ++i) {
      const Point a = at(i), b = at(i + 1);
      const float u = 2.5f * static_cast<float>(i) / kStrips;
      build.AddPanel(a, {b[0] - a[0], 0, b[2] - a[2]}, {0, 2.05f, 0}, cloth, {u, 0, u + 2.5f / kStrips, 6.8f});
    }
  }
}

void BuildPictures(const RoomOptions& options, Builder& build) {
  const auto d = static_cast<float>(options.size[2]);
  const uint64_t seed = options.seed * 100;
  const int32_t wood = build.AddMaterial("picture frame", {0.30f, 0.18f, 0.09f}, std::nullopt);
  const int32_t painting = build.AddMaterial("landscape", {1, 1, 1}, LandscapePicture(seed + 50));
  const int32_t chart = build.AddMaterial("reading chart", {1, 1, 1}, ReadingChartPicture());
  const int32_t rug = build.AddMaterial("rug", {1, 1, 1}, RugPicture(seed + 60));
  // On the wall opposite the window, where panels run towards smaller x.
  constexpr float kX = 4.4f, kY = 1.30f, kWide = 1.1f, kHigh = 0.75f, kRim = 0.05f;
  build.AddPanel({kX, kY, d - 0.02f}, {-kWide, 0, 0}, {0, kHigh, 0}, painting);
  build.AddBox({kX - kWide - kRim, kY - kRim, d - 0.045f}, {kX + kRim, kY, d}, wood);
  build.AddBox({kX - kWide - kRim, kY + kHigh, d - 0.045f}, {kX + kRim, kY + kHigh + kRim, d}, wood);
  build.AddBox({kX - kWide - kRim, kY, d - 0.045f}, {kX - kWide, kY + kHigh, d}, wood);
  build.AddBox({kX, kY, d - 0.045f}, {kX + kRim, kY + kHigh, d}, wood);
  build.AddPanel({1.75f, 1.05f, d - 0.004f}, {-0.7f, 0, 0}, {0, 1.0f, 0}, chart);
  build.AddPanel({0.5f, 0.008f, 3.0f}, {2.4f, 0, 0}, {0, 0, -1.6f}, rug);
}

// Two shelves of books on the wall at x = 0, spines towards the room.
void BuildBooks(const RoomOptions& options, Room& room, Builder& build) {
  const int32_t wood = build.AddMaterial("shelf", {0.55f, 0.38f, 0.22f}, std::nullopt);
  const int32_t leaves = build.AddMaterial("leaves", {0.85f, 0.82f, 0.72f}, std::nullopt);
  const int32_t spines = build.AddMaterial("spines", {1, 1, 1}, BookSpinesPicture(options.seed * 100 + 70));
  Random random(options.seed * 100 + 80);
  constexpr float kFrom = 0.35f, kTo = 2.15f, kDeep = 0.22f;
  int book = 0;
  for (const float y : {1.25f, 1.65f}) {
    build.AddBox({0, y - 0.025f, kFrom - 0.03f}, {kDeep + 0.02f, y, kTo + 0.03f}, wood);
    for (float z = kFrom; book < kBookSpines;) {
      const auto thick = static_cast<float>(random.Uniform(0.022, 0.055));
      const auto high = static_cast<float>(random.Uniform(0.22, 0.32));
      const auto front = static_cast<float>(random.Uniform(0.15, 0.21));
      if (z + thick > kTo) break;
      build.AddBox({0.005f, y, z}, {front - 0.002f, y + high, z + thick}, leaves);
      const float u = static_cast<float>(book % (kBookSpines / 2)) / (kBookSpines / 2);
      const float v = book < kBookSpines / 2 ? 0.5f : 0.0f;
      build.AddPanel({front, y, z + thick}, {0, 0, -thick}, {0, high, 0}, spines,
                     {u + 0.0005f, v + 0.001f, u + 1.0f / (kBookSpines / 2) - 0.0005f, v + 0.499f});
      z += thick + 0.001f;
      ++book;
    }
  }
  room.furniture.push_back({{0, 1.2f, kFrom}, {kDeep + 0.02f, 2.0f, kTo}});
}

// Halton sequence: evenly spread numbers in 0–1.
double Spread(int index, int base) {
  double value = 0, digit = 1;
  for (int i = index; i > 0; i /= base) {
    digit /= base;
    value += digit * (i % base);
  }
  return value;
}

bool IsFree(const Room& room, const std::array<double, 3>& eye) {
  return std::none_of(room.furniture.begin(), room.furniture.end(), [&](const Room::Box& box) {
    bool inside = true;
    for (size_t k = 0; k < 3; ++k) {
      inside = inside && eye[k] > double{box.low[k]} - kFromFurniture && eye[k] < double{box.high[k]} + kFromFurniture;
    }
    return inside;
  });
}

}  // namespace

Result<std::vector<PlacedMesh>> ReadFurniture(const std::filesystem::path& file, const std::filesystem::path& objects) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(file, uint64_t{1} << 20));
  std::vector<PlacedMesh> pieces;
  std::vector<std::string> addresses;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    PlacedMesh piece;
    std::string more;
    if (!(words >> piece.mesh) || piece.mesh[0] == '#') continue;
    words >> piece.at[0] >> piece.at[1] >> piece.at[2] >> piece.turn >> piece.height;
    if (!words || (words >> more) || !(piece.height > 0 && piece.height < 100)) {
      return Error{ErrorCode::kBadFile,
                   Cat(file.string(), ": line ", number,
                       ": expected a mesh, x, y, z (metres), turn (degrees) and height (metres, above 0)")};
    }
    addresses.push_back(piece.mesh);
    pieces.push_back(std::move(piece));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(addresses, ResolveAddresses(addresses, objects));
  for (size_t i = 0; i < pieces.size(); ++i) pieces[i].mesh = addresses[i];
  return pieces;
}

Result<Room> FurnishRoom(const std::vector<PlacedMesh>& furniture, const RoomOptions& options) {
  const auto& size = options.size;
  if (!(size[0] >= 4.5 && size[1] >= 2.5 && size[2] >= 4 && size[0] < 20 && size[1] < 20 && size[2] < 20)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("a room must be 4.5 x 2.5 x 4 to 20 x 20 x 20 m, not ", size[0], " x ", size[1], " x ", size[2])};
  }
  Room room;
  room.size = size;
  Builder build(room.mesh);
  BuildShell(options, build);
  BuildWindow(options, build);
  BuildCurtains(options.seed * 100 + 40, build);
  BuildPictures(options, build);
  BuildBooks(options, room, build);
  for (const PlacedMesh& piece : furniture) ANCHORSPLAT_RETURN_IF_ERROR(Place(piece, room));
  room.daylight.corner = {kWindowLeft, kSill, -0.03f};
  room.daylight.right = {kWindowRight - kWindowLeft, 0, 0};
  room.daylight.up = {0, kLintel - kSill, 0};
  for (size_t k = 0; k < 3; ++k) room.daylight.high[k] = static_cast<float>(size[k]);
  room.daylight.low = {0, 0, 0};
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(room.mesh));
  return room;
}

Result<ViewSetCameras> RoomCameras(const Room& room, int count, int low, int high) {
  if (count < 1 || count > 10'000 || low < 4 || high < 4 || low % 4 != 0 || high % 4 != 0) {
    return Error{ErrorCode::kBadArgument, Cat("expected 1 to 10,000 views, with widths that are multiples of 4, not ",
                                              count, " of ", low, " and ", high, " pixels")};
  }
  ViewSetCameras cameras;
  const int digits = count > 1000 ? 4 : 3;
  const int most = 100 * count + 1000;  // attempts
  for (int index = 1, made = 0; made < count; ++index) {
    if (index > most) return Error{ErrorCode::kBadArgument, "the room has no free space for cameras"};
    std::array<double, 3> eye;
    for (size_t k = 0; k < 3; ++k) {
      const double from = k == 1 ? 0.6 : kFromWalls, to = k == 1 ? 2.1 : room.size[k] - kFromWalls;
      eye[k] = from + (to - from) * Spread(index, std::array{2, 3, 5}[k]);
    }
    if (!IsFree(room, eye)) continue;
    const double yaw = 2 * std::numbers::pi * Spread(index, 7);
    const double pitch = (-38 + 56 * Spread(index, 11)) * std::numbers::pi / 180;
    const std::array<double, 3> target = {eye[0] + std::cos(pitch) * std::sin(yaw), eye[1] + std::sin(pitch),
                                          eye[2] + std::cos(pitch) * std::cos(yaw)};
    Camera camera;
    ANCHORSPLAT_ASSIGN_OR_RETURN(camera.world_to_camera, LookAt(eye, target, {0, 1, 0}));
    const std::string number = std::to_string(made++);
    camera.name = std::string(static_cast<size_t>(digits) - number.size(), '0') + number;
    for (const auto& [set, width] : {std::pair(&cameras.low, low), std::pair(&cameras.high, high)}) {
      camera.intrinsics = PinholeFromFov(width, width / 4 * 3, kFieldOfView * std::numbers::pi / 180);
      set->cameras.push_back(camera);
    }
  }
  return cameras;
}

}  // namespace anchorsplat

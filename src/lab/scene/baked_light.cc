#include "scene/baked_light.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"
#include "core/vector3.h"
#include "scene/ray_tracer.h"

namespace anchorsplat {

namespace {

using Place = std::array<float, 3>;

constexpr size_t kMostTriangles = size_t{1} << 25;
constexpr int kRings = 8, kSpokes = 16;  // directions tested for openness
constexpr int kPanes = 8;                // window points per side
constexpr float kLift = 2e-3f;           // offset of ray origins from the surface

Place Plus(const Place& a, const Place& b, float times) {
  return {a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]};
}

Place ToUnit(const Place& a) {
  const float square = Dot(a, a);
  return square > 0 ? Plus({0, 0, 0}, a, 1 / std::sqrt(square)) : Place{0, 0, 0};
}

// Subdivides triangles one after another, creating an edge's midpoint once for both sides.
class Cutter {
 public:
  Cutter(Mesh& mesh, float longest) : mesh_(mesh), square_(longest * longest) {}

  bool Cut() {
    std::vector<std::array<uint32_t, 3>> pending(mesh_.triangles.rbegin(), mesh_.triangles.rend());
    std::vector<int32_t> materials(mesh_.triangle_materials.rbegin(), mesh_.triangle_materials.rend());
    mesh_.triangles.clear();
    mesh_.triangle_materials.clear();
    while (!pending.empty()) {
      const auto corners = pending.back();
      const int32_t material = materials.back();
      pending.pop_back();
      materials.pop_back();
      // The longest edge first, chosen by the edge alone, so that both sides of it are cut alike.
      size_t longest = 3;
      float most = square_;
      for (size_t k = 0; k < 3; ++k) {
        const float square = SquareOf(corners[k], corners[(k + 1) % 3]);
        if (square > most) {
          most = square;
          longest = k;
        }
      }
      if (longest == 3 || mesh_.materials[static_cast<size_t>(material)].lit) {
        mesh_.triangles.push_back(corners);
        mesh_.triangle_materials.push_back(material);
        continue;
      }
      if (pending.size() + mesh_.triangles.size() + 2 > kMostTriangles) return false;
      const uint32_t a = corners[longest], b = corners[(longest + 1) % 3], c = corners[(longest + 2) % 3];
      const uint32_t middle = Middle(a, b);
      pending.push_back({a, middle, c});
      pending.push_back({middle, b, c});
      materials.insert(materials.end(), {material, material});
    }
    return true;
  }

 private:
  float SquareOf(uint32_t a, uint32_t b) const {
    const Place edge = Plus(mesh_.positions[a], mesh_.positions[b], -1);
    return Dot(edge, edge);
  }

  template <size_t n>
  static void PushMiddle(std::vector<std::array<float, n>>& values, uint32_t a, uint32_t b) {
    if (values.empty()) return;
    std::array<float, n> middle;
    for (size_t k = 0; k < n; ++k) middle[k] = 0.5f * (values[a][k] + values[b][k]);
    values.push_back(middle);
  }

  uint32_t Middle(uint32_t a, uint32_t b) {
    const auto [it, is_new] = middles_.try_emplace(std::minmax(a, b), static_cast<uint32_t>(mesh_.positions.size()));
    if (is_new) {
      PushMiddle(mesh_.positions, a, b);
      PushMiddle(mesh_.normals, a, b);
      PushMiddle(mesh_.uvs, a, b);
      PushMiddle(mesh_.colors, a, b);
    }
    return it->second;
  }

  Mesh& mesh_;
  float square_;
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles_;
};

// Gives each corner without a normal a vertex of its own, because light differs between faces.
void GiveNormals(Mesh& mesh) {
  mesh.normals.resize(mesh.positions.size(), {0, 0, 0});
  for (auto& triangle : mesh.triangles) {
    const Place e = Plus(mesh.positions[triangle[1]], mesh.positions[triangle[0]], -1);
    const Place f = Plus(mesh.positions[triangle[2]], mesh.positions[triangle[0]], -1);
    const Place face = ToUnit(Cross(e, f));
    for (uint32_t& corner : triangle) {
      const Place normal = ToUnit(mesh.normals[corner]);
      if (Dot(normal, normal) > 0) continue;
      const uint32_t own = static_cast<uint32_t>(mesh.positions.size());
      mesh.positions.push_back(mesh.positions[corner]);
      mesh.normals.push_back(face);
      if (!mesh.uvs.empty()) mesh.uvs.push_back(mesh.uvs[corner]);
      if (!mesh.colors.empty()) mesh.colors.push_back(mesh.colors[corner]);
      corner = own;
    }
  }
}

class Daylight {
 public:
  Daylight(const RayTracer& tracer, const DaylightOptions& options) : tracer_(tracer), options_(options) {
    // Cosine-weighted: rings of equal area on the disc below the hemisphere.
    for (int ring = 0; ring < kRings; ++ring) {
      const double radius = std::sqrt((ring + 0.5) / kRings);
      for (int spoke = 0; spoke < kSpokes; ++spoke) {
        const double angle = 2 * std::numbers::pi * (spoke + 0.5 * (ring % 2)) / kSpokes;
        directions_.push_back({static_cast<float>(radius * std::cos(angle)),
                               static_cast<float>(radius * std::sin(angle)),
                               static_cast<float>(std::sqrt(1 - radius * radius))});
      }
    }
    for (int j = 0; j < kPanes; ++j) {
      for (int i = 0; i < kPanes; ++i) {
        const Place row = Plus(options.corner, options.up, (static_cast<float>(j) + 0.5f) / kPanes);
        panes_.push_back(Plus(row, options.right, (static_cast<float>(i) + 0.5f) / kPanes));
      }
    }
    const Place across = Cross(options.right, options.up);
    inwards_ = ToUnit(across);
    pane_area_ = std::sqrt(Dot(across, across)) / (kPanes * kPanes);
  }

  // Light of the brighter side: closed objects are dark inside, and some files' normals point inwards.
  float At(const Place& place, const Place& normal) const {
    return std::max(OfSide(place, normal), OfSide(place, Plus({0, 0, 0}, normal, -1)));
  }

 private:
  float OfSide(const Place& place, const Place& normal) const {
    const Place eye = Plus(place, normal, kLift);
    for (size_t k = 0; k < 3; ++k) {
      if (eye[k] < options_.low[k] || eye[k] > options_.high[k]) return 0;
    }
    const Place other = std::abs(normal[1]) < 0.9f ? Place{0, 1, 0} : Place{1, 0, 0};
    const Place right = ToUnit(Cross(other, normal)), up = Cross(normal, right);
    int open = 0;
    for (const Place& d : directions_) {
      const Place way = Plus(Plus(Plus({0, 0, 0}, right, d[0]), up, d[1]), normal, d[2]);
      if (!tracer_.IsBlocked(eye, Plus(eye, way, options_.reach))) ++open;
    }
    float from_window = 0;
    for (const Place& pane : panes_) {
      const Place way = Plus(pane, eye, -1);
      const float square = std::max(Dot(way, way), 1e-4f), cosines = Dot(way, normal) * -Dot(way, inwards_);
      if (!(Dot(way, normal) > 0 && cosines > 0) || tracer_.IsBlocked(eye, pane)) continue;
      from_window += pane_area_ * cosines / (square * square);
    }
    return std::min(1.0f, 0.3f + 0.3f * static_cast<float>(open) / static_cast<float>(directions_.size()) +
                              0.5f * from_window / (from_window + 0.1f));
  }

  const RayTracer& tracer_;
  DaylightOptions options_;
  std::vector<Place> directions_;  // hemisphere around +z
  std::vector<Place> panes_;
  Place inwards_;
  float pane_area_;
};

}  // namespace

Status CutToEdges(Mesh& mesh, float longest_edge) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(mesh));
  if (!(longest_edge > 0)) return Error{ErrorCode::kBadArgument, "the longest edge must be above 0"};
  if (!Cutter(mesh, longest_edge).Cut()) {
    return Error{ErrorCode::kBadArgument,
                 Cat("a mesh with edges of at most ", longest_edge, " has more than ", kMostTriangles, " triangles")};
  }
  return {};
}

Status BakeDaylight(Mesh& mesh, const DaylightOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(mesh));
  GiveNormals(mesh);
  ANCHORSPLAT_RETURN_IF_ERROR(CutToEdges(mesh, options.longest_edge));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const RayTracer tracer, RayTracer::Create(mesh));
  std::vector<uint8_t> has_light(mesh.positions.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.materials[static_cast<size_t>(mesh.triangle_materials[t])].lit) continue;
    for (const uint32_t corner : mesh.triangles[t]) has_light[corner] = 1;
  }
  mesh.colors.resize(mesh.positions.size(), {1, 1, 1, 1});
  const Daylight daylight(tracer, options);
  ParallelFor(0, std::ssize(mesh.positions), 256, [&](int64_t first, int64_t last) {
    for (size_t i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i) {
      if (has_light[i] != 0) continue;
      const float light = daylight.At(mesh.positions[i], ToUnit(mesh.normals[i]));
      for (size_t k = 0; k < 3; ++k) mesh.colors[i][k] *= light;
    }
  });
  for (Material& material : mesh.materials) material.lit = true;
  return {};
}

}  // namespace anchorsplat

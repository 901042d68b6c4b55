#include "scene/ray_tracer.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>

#include "core/parallel.h"
#include "core/text.h"
#include "core/thread_clock.h"
#include "scene/embree.h"
#include "scene/surface_shader.h"
#include "scene/tile_coverage.h"

namespace anchorsplat {

namespace {

constexpr int kTile = 8;    // pixels per side; traced, then shaded while its hits are cached
constexpr int kPacket = 8;  // rays per Embree packet with AVX2
constexpr uint32_t kMiss = RTC_INVALID_GEOMETRY_ID;

struct DeviceRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct SceneRelease {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, DeviceRelease>;
using EmbreeScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, SceneRelease>;

// Query context passed to the filter of surfaces with holes.
struct TraceContext {
  embree::QueryContext base;
  float sample_area;
};

// Triangles of an Embree geometry, by primitive number.
struct Part {
  const SurfaceShader* shader = nullptr;
  std::vector<uint32_t> triangles;
};

// Filter: rejects hits on transparent texels, so that the ray continues.
void RejectHoles(const RTCFilterFunctionNArguments* args) {
  const Part& part = *static_cast<const Part*>(args->geometryUserPtr);
  const float sample_area = reinterpret_cast<const TraceContext*>(args->context)->sample_area;
  for (unsigned int i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    const SurfacePoint point{part.triangles[RTCHitN_primID(args->hit, args->N, i)], RTCHitN_u(args->hit, args->N, i),
                             RTCHitN_v(args->hit, args->N, i)};
    const std::array<float, 3> direction = {RTCRayN_dir_x(args->ray, args->N, i), RTCRayN_dir_y(args->ray, args->N, i),
                                            RTCRayN_dir_z(args->ray, args->N, i)};
    const float depth = RTCRayN_tfar(args->ray, args->N, i);
    if (part.shader->Alpha(point, direction, SampleFootprint(sample_area, depth)) < kAlphaTest) args->valid[i] = 0;
  }
}

// Camera rays: pixel position (x, y) has direction forward + x·right + y·down, so the distance along the ray is the
// depth.
struct RayFan {
  std::array<float, 3> origin;
  std::array<float, 3> corner;  // of the image
  std::array<float, 3> right;   // per pixel
  std::array<float, 3> down;

  explicit RayFan(const Camera& camera) {
    const Pinhole& k = camera.intrinsics;
    const auto& r = camera.world_to_camera.rotation;
    const auto center = camera.Center();
    for (size_t i = 0; i < 3; ++i) {
      origin[i] = static_cast<float>(center[i]);
      right[i] = static_cast<float>(r[i] / k.fx);
      down[i] = static_cast<float>(r[3 + i] / k.fy);
      corner[i] = static_cast<float>(r[6 + i] - r[i] * k.cx / k.fx - r[3 + i] * k.cy / k.fy);
    }
  }
};

struct Hit {
  SurfacePoint point;  // triangle kMiss: no hit
  float depth;
};

void Clear(RTCRayHit8& packet, const std::array<float, 3>& origin) {
  for (int i = 0; i < kPacket; ++i) {
    packet.ray.org_x[i] = origin[0];
    packet.ray.org_y[i] = origin[1];
    packet.ray.org_z[i] = origin[2];
    packet.ray.tnear[i] = 0;
    packet.ray.time[i] = 0;
    packet.ray.mask[i] = ~0u;
    packet.ray.id[i] = 0;
    packet.ray.flags[i] = 0;
  }
}

}  // namespace

struct RayTracer::Scene {
  Mesh mesh;
  std::unique_ptr<SurfaceShader> shader;
  Part parts[2];  // 0 solid, 1 with holes; indices are Embree's geometry ids, see Create
  const Part* part_of[2] = {};
  Device device;
  EmbreeScene embree;

  bool Attach(Part& part, bool with_holes);
};

namespace {

bool FillBuffers(RTCGeometry geometry, const Mesh& mesh, const Part& part) {
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), mesh.positions.size()));
  auto* indices = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(uint32_t), part.triangles.size()));
  if (vertices == nullptr || indices == nullptr) return false;
  std::memcpy(vertices, mesh.positions.data(), mesh.positions.size() * 3 * sizeof(float));
  for (const uint32_t t : part.triangles) {
    indices = std::copy(mesh.triangles[t].begin(), mesh.triangles[t].end(), indices);
  }
  return true;
}

}  // namespace

bool RayTracer::Scene::Attach(Part& part, bool with_holes) {
  RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  if (geometry == nullptr || !FillBuffers(geometry, mesh, part)) return false;
  if (with_holes) {
    rtcSetGeometryUserData(geometry, &part);
    rtcSetGeometryIntersectFilterFunction(geometry, RejectHoles);
    rtcSetGeometryOccludedFilterFunction(geometry, RejectHoles);
  }
  rtcCommitGeometry(geometry);
  const unsigned int id = rtcAttachGeometry(embree.get(), geometry);
  rtcReleaseGeometry(geometry);
  if (id >= 2) return false;
  part_of[id] = &part;
  return true;
}

TraceCost& TraceCost::operator+=(const TraceCost& other) {
  rays += other.rays;
  ray_seconds += other.ray_seconds;
  shade_seconds += other.shade_seconds;
  return *this;
}

RayTracer::RayTracer(std::unique_ptr<Scene> scene) : scene_(std::move(scene)) {}
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;
RayTracer::~RayTracer() = default;

const Mesh& RayTracer::mesh() const { return scene_->mesh; }

Result<RayTracer> RayTracer::Create(Mesh mesh) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(mesh));
  if (mesh.triangles.empty()) return Error{ErrorCode::kBadArgument, "mesh has no visible triangle"};
  constexpr size_t kMost = size_t{1} << 28;  // far below Embree's own bound of 2³²
  if (mesh.triangles.size() > kMost || mesh.positions.size() > kMost) {
    return Error{ErrorCode::kBadArgument, Cat("mesh has more than ", kMost, " triangles or vertices")};
  }
  auto scene = std::make_unique<Scene>();
  scene->mesh = std::move(mesh);
  scene->shader = std::make_unique<SurfaceShader>(scene->mesh);
  for (Part& part : scene->parts) part.shader = scene->shader.get();
  for (uint32_t t = 0; t < scene->mesh.triangles.size(); ++t) {
    scene->parts[scene->shader->HasHoles(t) ? 1 : 0].triangles.push_back(t);
  }

  // max_isa: see the class comment. AVX-512 is no faster here.
  scene->device.reset(rtcNewDevice("max_isa=avx2"));
  const auto embree_error = [&](const char* what) {
    const RTCError code = rtcGetDeviceError(scene->device.get());
    return Error{ErrorCode::kIo, Cat("Embree ", what, " (error ", static_cast<int>(code), ")",
                                     code == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory" : "")};
  };
  if (scene->device == nullptr) return embree_error("does not start");
  scene->embree.reset(rtcNewScene(scene->device.get()));
  if (scene->embree == nullptr) return embree_error("cannot make a scene");
  rtcSetSceneBuildQuality(scene->embree.get(), RTC_BUILD_QUALITY_HIGH);  // every tree is queried a billion times
  rtcSetSceneFlags(scene->embree.get(), RTC_SCENE_FLAG_ROBUST);          // no rays pass between adjacent triangles
  for (const bool with_holes : {false, true}) {
    Part& part = scene->parts[with_holes ? 1 : 0];
    if (!part.triangles.empty() && !scene->Attach(part, with_holes)) return embree_error("refuses the triangles");
  }
  // A single-threaded arena that Embree's tasks cannot leave; other runs keep their threads.
  tbb::task_arena(1).execute([&] { rtcCommitScene(scene->embree.get()); });
  if (rtcGetDeviceError(scene->device.get()) != RTC_ERROR_NONE) return embree_error("cannot build its tree");
  return RayTracer(std::move(scene));
}

namespace {

// Renders one picture; tiles are independent.
class TileTracer {
 public:
  TileTracer(RTCScene scene, const Part* const* parts, const SurfaceShader& shader, const Camera& camera, int samples)
      : scene_(scene), parts_(parts), shader_(shader), fan_(camera), per_pixel_(samples * samples) {
    embree::Init(context_.base);
    const Pinhole& k = camera.intrinsics;
    context_.sample_area = static_cast<float>(1 / (k.fx * k.fy * per_pixel_));
    for (int pixel = 0; pixel < kTile * kTile; ++pixel) {
      for (int sample = 0; sample < per_pixel_; ++sample) {
        const float x = (static_cast<float>(sample % samples) + 0.5f) / static_cast<float>(samples);
        const float y = (static_cast<float>(sample / samples) + 0.5f) / static_cast<float>(samples);
        places_x_.push_back(static_cast<float>(pixel % kTile) + x);
        places_y_.push_back(static_cast<float>(pixel / kTile) + y);
      }
    }
    hits_.resize(places_x_.size());
  }

  // Renders the part of the tile at (x0, y0) inside `image`.
  void Trace(int x0, int y0, Image& image, TraceCost& cost) {
    const int columns = std::min(kTile, image.width - x0), rows = std::min(kTile, image.height - y0);
    const double begin = ThreadSeconds();
    CastRays(x0, y0, columns, rows);
    const double middle = ThreadSeconds();
    ShadePixels(x0, y0, columns, rows, image);
    cost.rays += int64_t{columns} * rows * per_pixel_;
    cost.ray_seconds += middle - begin;
    cost.shade_seconds += ThreadSeconds() - middle;
  }

 private:
  // Casts rays in order of pixels, then samples, row by row. Skips rays outside the image.
  void CastRays(int x0, int y0, int columns, int rows) {
    RTCRayHit8 packet;
    Clear(packet, fan_.origin);
    alignas(32) int valid[kPacket];
    const float left = static_cast<float>(x0), top = static_cast<float>(y0);
    const size_t count = static_cast<size_t>(kTile * rows * per_pixel_);  // a multiple of kPacket
    for (size_t first = 0; first < count; first += kPacket) {
      for (size_t i = 0; i < kPacket; ++i) {
        const float px = places_x_[first + i], py = places_y_[first + i];
        valid[i] = px < static_cast<float>(columns) ? -1 : 0;
        const float x = left + px, y = top + py;
        packet.ray.dir_x[i] = fan_.corner[0] + x * fan_.right[0] + y * fan_.down[0];
        packet.ray.dir_y[i] = fan_.corner[1] + x * fan_.right[1] + y * fan_.down[1];
        packet.ray.dir_z[i] = fan_.corner[2] + x * fan_.right[2] + y * fan_.down[2];
        packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
        packet.hit.geomID[i] = kMiss;
        packet.hit.instID[0][i] = kMiss;
      }
      embree::IntersectCoherent(valid, scene_, context_.base, packet);
      for (size_t i = 0; i < kPacket; ++i) {
        Hit& hit = hits_[first + i];
        if (packet.hit.geomID[i] == kMiss) {
          hit.point.triangle = kMiss;
          continue;
        }
        hit.point = {parts_[packet.hit.geomID[i]]->triangles[packet.hit.primID[i]], packet.hit.u[i], packet.hit.v[i]};
        hit.depth = packet.ray.tfar[i];
      }
    }
  }

  void ShadePixels(int x0, int y0, int columns, int rows, Image& image) const {
    const float left = static_cast<float>(x0), top = static_cast<float>(y0);
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const size_t first = static_cast<size_t>((row * kTile + column) * per_pixel_);
        float sum[3] = {};
        int met = 0;
        for (size_t ray = first; ray < first + static_cast<size_t>(per_pixel_); ++ray) {
          const Hit& hit = hits_[ray];
          if (hit.point.triangle == kMiss) continue;
          const float x = left + places_x_[ray], y = top + places_y_[ray];
          std::array<float, 3> direction;
          for (size_t k = 0; k < 3; ++k) direction[k] = fan_.corner[k] + x * fan_.right[k] + y * fan_.down[k];
          const auto color = shader_.Color(hit.point, direction, SampleFootprint(context_.sample_area, hit.depth));
          for (size_t k = 0; k < 3; ++k) sum[k] += color[k];
          ++met;
        }
        for (int c = 0; c < 3; ++c) image.at(c, y0 + row, x0 + column) = met > 0 ? sum[c] / static_cast<float>(met) : 0;
        image.at(3, y0 + row, x0 + column) = static_cast<float>(met) / static_cast<float>(per_pixel_);
      }
    }
  }

  RTCScene scene_;
  const Part* const* parts_;
  const SurfaceShader& shader_;
  RayFan fan_;
  int per_pixel_;
  TraceContext context_;
  std::vector<float> places_x_;  // of the tile's rays, in pixels from its corner
  std::vector<float> places_y_;
  std::vector<Hit> hits_;
};

void ClearTile(int x0, int y0, Image& image) {
  const int columns = std::min(kTile, image.width - x0), rows = std::min(kTile, image.height - y0);
  for (int c = 0; c < 4; ++c) {
    for (int y = y0; y < y0 + rows; ++y) std::fill_n(&image.at(c, y, x0), columns, 0.0f);
  }
}

}  // namespace

Result<Image> RayTracer::Render(const Camera& camera, const TraceOptions& options, TraceCost* cost) const {
  const Pinhole& k = camera.intrinsics;
  if (options.samples < 1 || options.samples > kMaxTraceSamples) {
    return Error{ErrorCode::kBadArgument,
                 Cat("samples per pixel side must be 1 to ", kMaxTraceSamples, ", not ", options.samples)};
  }
  if (k.width < 1 || k.height < 1 || k.width > kMaxImageSide || k.height > kMaxImageSide ||
      int64_t{k.width} * k.height > kMaxImagePixels || !(k.fx > 0) || !(k.fy > 0)) {
    return Error{ErrorCode::kBadArgument, Cat("cannot make a view of ", k.width, " x ", k.height,
                                              " pixels with focal lengths ", k.fx, " and ", k.fy)};
  }
  Image image(k.width, k.height, 4);
  const TileCoverage coverage(scene_->mesh, camera, kTile);
  std::mutex mutex;
  const auto trace_rows = [&](int64_t first, int64_t last) {
    TileTracer tracer(scene_->embree.get(), scene_->part_of, *scene_->shader, camera, options.samples);
    TraceCost mine;
    for (int row = static_cast<int>(first); row < static_cast<int>(last); ++row) {
      for (int column = 0; column < coverage.columns(); ++column) {
        if (coverage.touched(column, row)) {
          tracer.Trace(column * kTile, row * kTile, image, mine);
        } else {
          ClearTile(column * kTile, row * kTile, image);
        }
      }
    }
    const std::lock_guard<std::mutex> lock(mutex);
    if (cost != nullptr) *cost += mine;
  };
  // Isolated: a thread waiting for the last rows must not start another view of a caller that renders several at once,
  // or pictures would pile up.
  tbb::this_task_arena::isolate([&] { ParallelFor(0, coverage.rows(), 4, trace_rows); });
  return image;
}

std::array<float, 3> RayTracer::Position(const SurfacePoint& point) const {
  const auto& [a, b, c] = scene_->mesh.triangles[point.triangle];
  const float w = 1 - point.u - point.v;
  std::array<float, 3> out;
  for (size_t k = 0; k < 3; ++k) {
    out[k] = w * scene_->mesh.positions[a][k] + point.u * scene_->mesh.positions[b][k] +
             point.v * scene_->mesh.positions[c][k];
  }
  return out;
}

bool RayTracer::IsBlocked(const std::array<float, 3>& from, const std::array<float, 3>& to) const {
  RTCRay ray = {};
  ray.org_x = from[0];
  ray.org_y = from[1];
  ray.org_z = from[2];
  ray.dir_x = to[0] - from[0];
  ray.dir_y = to[1] - from[1];
  ray.dir_z = to[2] - from[2];
  ray.tnear = 1e-4f;
  ray.tfar = 1 - 1e-4f;
  ray.mask = ~0u;
  TraceContext context;
  embree::Init(context.base);
  context.sample_area = 0;
  return embree::Occluded(scene_->embree.get(), context.base, ray);
}

std::vector<RayTracer::Sighting> RayTracer::LookAtPoints(std::span<const SurfacePoint> points,
                                                         std::span<const std::array<double, 3>> eyes,
                                                         float sample_area) const {
  std::vector<Sighting> out(points.size());
  const auto look = [&](size_t i, size_t e) {
    const std::array<float, 3> place = Position(points[i]);
    std::array<float, 3> direction;
    RTCRay ray = {};
    ray.org_x = static_cast<float>(eyes[e][0]);
    ray.org_y = static_cast<float>(eyes[e][1]);
    ray.org_z = static_cast<float>(eyes[e][2]);
    ray.dir_x = direction[0] = place[0] - ray.org_x;
    ray.dir_y = direction[1] = place[1] - ray.org_y;
    ray.dir_z = direction[2] = place[2] - ray.org_z;
    ray.tfar = 1 - 1e-3f;  // just short of the point, so that its own surface does not block it
    ray.mask = ~0u;
    // These rays have length 1 at the point, camera rays depth 1; on the axis they differ by the distance.
    const float distance =
        std::sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    TraceContext context;
    embree::Init(context.base);
    context.sample_area = sample_area * distance * distance * distance;
    if (scene_->shader->Alpha(points[i], direction, context.sample_area) < kAlphaTest) return false;
    if (embree::Occluded(scene_->embree.get(), context.base, ray)) return false;
    out[i] = {static_cast<int>(e), scene_->shader->Color(points[i], direction, context.sample_area)};
    return true;
  };
  ParallelFor(0, static_cast<int64_t>(points.size()), 256, [&](int64_t first, int64_t last) {
    for (size_t i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i) {
      for (size_t e = 0; e < eyes.size() && !look(i, (i + e) % eyes.size()); ++e) {
      }
    }
  });
  return out;
}

}  // namespace anchorsplat

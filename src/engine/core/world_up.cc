#include "core/world_up.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>

#include "core/number_text.h"
#include "core/text.h"
#include "core/vector3.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<double, 3>;

constexpr std::string_view kMark = "world up: ";
constexpr std::string_view kVerticalAxis = "vertical axis:";
constexpr double kAlmostAnAxis = 0.93;  // cosine of 21°: nobody holds a camera level on average to the degree

double Length(const Vec3& v) { return std::hypot(v[0], v[1], v[2]); }

std::optional<Vec3> Unit(const Vec3& v, double least) {
  const double length = Length(v);
  if (!(length > least) || !std::isfinite(length)) return std::nullopt;
  return Vec3{v[0] / length, v[1] / length, v[2] / length};
}

// Three numbers with `between` before, between and behind them, and nothing else.
std::optional<Vec3> ThreeNumbers(std::string_view text, std::string_view between) {
  const auto skip = [&] { text.remove_prefix(std::min(text.find_first_not_of(between), text.size())); };
  Vec3 numbers{};
  for (double& x : numbers) {
    skip();
    const auto [end, code] = FromChars(text.data(), text.data() + text.size(), x);
    if (code != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
  }
  skip();
  return text.empty() ? Unit(numbers, 0) : std::nullopt;
}

std::optional<Vec3> OwnUp(std::string_view text) {
  return text.starts_with(kMark) ? ThreeNumbers(text.substr(kMark.size()), " ") : std::nullopt;
}

// What follows "vertical axis:" in any case; nothing in other comments.
std::optional<std::string> VerticalAxis(std::string_view text) {
  if (text.size() < kVerticalAxis.size()) return std::nullopt;
  std::string small(text);
  for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (!small.starts_with(kVerticalAxis)) return std::nullopt;
  small.erase(0, kVerticalAxis.size());
  while (!small.empty() && small.back() == ' ') small.pop_back();
  small.erase(0, std::min(small.find_first_not_of(' '), small.size()));
  return small;
}

std::optional<Vec3> OthersUp(std::string_view text) {
  const std::optional<std::string> said = VerticalAxis(text);
  if (!said || *said == "y") return std::nullopt;
  const bool has_sign = said->size() == 2 && (said->front() == '-' || said->front() == '+');
  if (said->size() == 1 || has_sign) {
    const size_t axis = std::string_view("xyz").find(said->back());
    if (axis > 2) return std::nullopt;
    Vec3 up{};
    up[axis] = said->front() == '-' ? -1 : 1;
    return up;
  }
  return ThreeNumbers(*said, " ,[]()");
}

}  // namespace

std::optional<Vec3> WorldUp(std::span<const Camera> cameras) {
  Vec3 sum{};
  for (const Camera& camera : cameras) {
    for (size_t k = 0; k < 3; ++k) sum[k] -= camera.world_to_camera.rotation[3 + k];  // its y points down
  }
  // Cameras held every way have no up in common.
  const std::optional<Vec3> mean = Unit(sum, 0.1 * static_cast<double>(cameras.size()));
  if (!mean) return std::nullopt;
  size_t largest = 0;
  for (size_t k = 1; k < 3; ++k) {
    if (std::abs((*mean)[k]) > std::abs((*mean)[largest])) largest = k;
  }
  if (std::abs((*mean)[largest]) < kAlmostAnAxis) return mean;
  Vec3 axis{};
  axis[largest] = (*mean)[largest] > 0 ? 1 : -1;
  return axis;
}

std::string UpComment(const Vec3& up) { return Cat(kMark, up[0], " ", up[1], " ", up[2]); }

std::optional<Vec3> UpOf(const std::vector<std::string>& comments) {
  for (const auto parse : {OwnUp, OthersUp}) {
    for (const std::string& comment : comments) {
      if (const auto up = parse(comment)) return up;
    }
  }
  return std::nullopt;
}

void SetUp(const Vec3& up, std::vector<std::string>& comments) {
  std::erase_if(comments, [](const std::string& text) { return text.starts_with(kMark) || VerticalAxis(text); });
  comments.push_back(UpComment(up));
}

void TurnUpComments(const std::array<double, 9>& m, std::vector<std::string>& comments) {
  for (std::string& comment : comments) {
    const auto own = OwnUp(comment);
    const auto up = own ? own : OthersUp(comment);
    if (!up) continue;
    Vec3 turned{};
    for (size_t k = 0; k < 3; ++k) {
      turned[k] = m[3 * k] * (*up)[0] + m[3 * k + 1] * (*up)[1] + m[3 * k + 2] * (*up)[2];
      if (turned[k] == 0) turned[k] = 0;  // no negative zeros for people to wonder at
    }
    comment = UpComment(turned);
  }
  // An axis without a sign says nothing any more where it may be another one now.
  const bool same_axis = m[4] != 0;
  if (!same_axis) std::erase_if(comments, [](const std::string& comment) { return VerticalAxis(comment) == "y"; });
}

void TurnUp(const Vec3& target, const Vec3& up, std::vector<Camera>& cameras) {
  const std::optional<Vec3> unit = Unit(up, 0);
  if (!unit || *unit == Vec3{0, 1, 0}) return;
  const Vec3& y = *unit;
  // The columns of the rotation: where x, y and z go. x stays as near to itself as it can.
  const Vec3 start = std::abs(y[0]) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
  const double along = Dot(start, y);
  const Vec3 x = *Unit({start[0] - along * y[0], start[1] - along * y[1], start[2] - along * y[2]}, 0);
  const Vec3 z = Cross(x, y);
  for (Camera& camera : cameras) {
    Pose& pose = camera.world_to_camera;
    const Pose old = pose;
    for (size_t r = 0; r < 3; ++r) {
      const double* row = old.rotation.data() + 3 * r;
      for (size_t k = 0; k < 3; ++k) {
        pose.rotation[3 * r + k] = row[0] * x[k] + row[1] * y[k] + row[2] * z[k];
      }
      for (size_t k = 0; k < 3; ++k) {
        pose.translation[r] += (old.rotation[3 * r + k] - pose.rotation[3 * r + k]) * target[k];
      }
    }
  }
}

Result<CameraSet> UprightOrbit(int count, double radius, const Vec3& target, const Vec3& up,
                               const Pinhole& intrinsics) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet orbit, OrbitCameras(count, radius, target, intrinsics));
  TurnUp(target, up, orbit.cameras);
  return orbit;
}

}  // namespace anchorsplat

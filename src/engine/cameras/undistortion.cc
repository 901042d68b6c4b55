#include "cameras/undistortion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "cameras/camera_checks.h"
#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr double kShortest = 0.2, kLongest = 2;  // limits of the undistorted size relative to the original
constexpr int kMostBorderPoints = 4096;          // sampled per side
constexpr int kRowsPerTask = 8;
// Fraction of the inscribed circle that the lens must cover. Polynomials of real lenses fold only beyond the image, if
// at all; a fisheye's circle may be smaller than the image.
constexpr double kLeastOfRadial = 0.75, kLeastOfFisheye = 0.5;
constexpr int kDirections = 64;  // sampled for that check

// Undistorted distances of the two image borders from the principal point along an axis, at their nearest.
struct Borders {
  double low = std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

// Scale of a side, without limits.
double SideScale(const Borders& borders, double size, double principal) {
  return 1 / std::max(principal / borders.low, (size - 0.5 - principal) / borders.high);
}

// The non-zero coefficients: "k1 = -50, p2 = 0.1".
std::string Coefficients(const Lens& lens) {
  std::string text;
  const auto add = [&text](const char* name, size_t number, double value) {
    if (value != 0) text += Cat(text.empty() ? "" : ", ", name, number, " = ", value);
  };
  for (size_t i = 0; i < lens.radial.size(); ++i) add("k", i + 1, lens.radial[i]);
  // Names of FULL_OPENCV and transforms.json.
  for (size_t i = 0; i < lens.denominator.size(); ++i) add("k", i + 4, lens.denominator[i]);
  for (size_t i = 0; i < lens.tangential.size(); ++i) add("p", i + 1, lens.tangential[i]);
  if (lens.skew != 0) text += Cat(text.empty() ? "" : ", ", "skew = ", lens.skew);
  return text.empty() ? "all coefficients 0" : text;
}

Error BadLens(const Lens& lens, const std::string& what) {
  return Error{ErrorCode::kBadFile, Cat("lens distortion (", Coefficients(lens), ") ", what,
                                        "; correct the coefficients, or undistort the pictures first")};
}

// Whether the lens covers every point of a circle around the image centre.
bool DrawsTheMiddle(const LensInverse& inverse, const Pinhole& distorted, double share) {
  const double radius = share * 0.5 * std::min(distorted.width, distorted.height);
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections;
    const double u = 0.5 * distorted.width + radius * std::cos(angle),
                 v = 0.5 * distorted.height + radius * std::sin(angle);
    if (!inverse.Undistort({(u - distorted.cx) / distorted.fx, (v - distorted.cy) / distorted.fy})) return false;
  }
  return true;
}

std::array<float, 4> CatmullRom(float t) {
  const float u = t * t, v = u * t;
  return {0.5f * (-v + 2 * u - t), 0.5f * (3 * v - 5 * u + 2), 0.5f * (-3 * v + 4 * u + t), 0.5f * (v - u)};
}

// Premultiplies alpha, for averaging; images without alpha are unchanged.
Image Premultiplied(const Image& image) {
  Image out = image;
  for (int c = 0; c < 3 && image.channels == 4; ++c) {
    float* to = out.channel(c);
    for (int64_t i = 0; i < image.plane(); ++i) to[i] *= image.channel(3)[i];
  }
  return out;
}

// Converts pixel i back to straight alpha and clamps to 0–1, which cubics exceed.
void Unpremultiply(Image& image, int64_t i) {
  for (int c = 0; c < image.channels; ++c) image.channel(c)[i] = std::clamp(image.channel(c)[i], 0.0f, 1.0f);
  if (image.channels != 4) return;
  const float alpha = image.channel(3)[i];
  for (int c = 0; c < 3; ++c) {
    float& value = image.channel(c)[i];
    value = alpha > 0 ? std::min(1.0f, value / alpha) : 0.0f;
  }
}

bool AnyIgnored(const Buffer<uint8_t>& ignored) {
  return std::any_of(ignored.begin(), ignored.end(), [](uint8_t x) { return x != 0; });
}

}  // namespace

Result<Pinhole> UndistortedPinhole(const Lens& lens, const Pinhole& distorted) {
  if (lens.IsIdentity()) return distorted;
  const LensInverse inverse(lens);
  if (!(inverse.largest_radius() > 0)) {
    return BadLens(lens, "folds the picture at its centre");
  }
  const double least = lens.model == LensModel::kFisheye ? kLeastOfFisheye : kLeastOfRadial;
  if (!DrawsTheMiddle(inverse, distorted, least)) {
    return BadLens(lens,
                   Cat("cannot be inverted: it covers less than ", std::lround(100 * least), "% of the way from the ",
                       distorted.width, " x ", distorted.height, " picture's centre to its border"));
  }
  Borders x, y;
  const auto look = [&](double u, double v, double& nearest, size_t axis, double sign) {
    const auto p = inverse.Undistort({(u - distorted.cx) / distorted.fx, (v - distorted.cy) / distorted.fy});
    if (p) nearest = std::min(nearest, sign * (*p)[axis] * (axis == 0 ? distorted.fx : distorted.fy));
  };
  const auto walk = [](int size, auto&& at) {
    const int count = std::min(size, kMostBorderPoints);
    for (int i = 0; i < count; ++i) at(count > 1 ? static_cast<int>(int64_t{i} * (size - 1) / (count - 1)) + 0.5 : 0.5);
  };
  walk(distorted.height, [&](double v) {
    look(0.5, v, x.low, 0, -1);
    look(distorted.width - 0.5, v, x.high, 0, 1);
  });
  walk(distorted.width, [&](double u) {
    look(u, 0.5, y.low, 1, -1);
    look(u, distorted.height - 0.5, y.high, 1, 1);
  });
  const double wide = SideScale(x, distorted.width, distorted.cx), high = SideScale(y, distorted.height, distorted.cy);
  if (!(wide >= kShortest && high >= kShortest)) {
    return BadLens(lens, Cat("leaves less than a fifth of the ", distorted.width, " x ", distorted.height,
                             " picture's side after undistortion"));
  }
  Pinhole out = distorted;
  out.width = std::max(1, static_cast<int>(std::min(wide, kLongest) * distorted.width));
  out.height = std::max(1, static_cast<int>(std::min(high, kLongest) * distorted.height));
  out.cx = distorted.cx * out.width / distorted.width;
  out.cy = distorted.cy * out.height / distorted.height;
  if (const Status status = CheckIntrinsics(out); !status.ok()) {
    return Error{ErrorCode::kBadFile, Cat("after undistortion: ", status.error().message)};
  }
  return out;
}

ViewPicture Undistort(const ViewPicture& picture, const Lens& lens, const Pinhole& distorted,
                      const Pinhole& undistorted) {
  const Image source = Premultiplied(picture.image);
  const int width = source.width, height = source.height;
  const double largest = LensInverse(lens).largest_radius();
  ViewPicture out{Image(undistorted.width, undistorted.height, source.channels),
                  Buffer<uint8_t>(static_cast<size_t>(int64_t{undistorted.width} * undistorted.height))};
  ParallelFor(0, undistorted.height, kRowsPerTask, [&](int64_t first, int64_t last) {
    for (int64_t row = first; row < last; ++row) {
      for (int column = 0; column < undistorted.width; ++column) {
        const int64_t at = row * undistorted.width + column;
        const PlanePoint p = {(column + 0.5 - undistorted.cx) / undistorted.fx,
                              (static_cast<double>(row) + 0.5 - undistorted.cy) / undistorted.fy};
        const PlanePoint d = Distort(lens, p);
        const double u = distorted.fx * d[0] + distorted.cx, v = distorted.fy * d[1] + distorted.cy;
        if (!(u >= 0 && u <= width && v >= 0 && v <= height) || std::hypot(p[0], p[1]) > largest) {
          out.ignored[static_cast<size_t>(at)] = 1;
          for (int c = 0; c < source.channels; ++c) out.image.channel(c)[at] = 0;
          continue;
        }
        const int x = static_cast<int>(std::floor(u - 0.5)), y = static_cast<int>(std::floor(v - 0.5));
        const auto wx = CatmullRom(static_cast<float>(u - 0.5 - x)), wy = CatmullRom(static_cast<float>(v - 0.5 - y));
        std::array<int, 4> columns{}, rows{};
        for (int k = 0; k < 4; ++k) {
          columns[static_cast<size_t>(k)] = std::clamp(x - 1 + k, 0, width - 1);
          rows[static_cast<size_t>(k)] = std::clamp(y - 1 + k, 0, height - 1);
        }
        for (int c = 0; c < source.channels; ++c) {
          float sum = 0;
          for (size_t j = 0; j < 4; ++j) {
            const float* from = source.channel(c) + int64_t{rows[j]} * width;
            sum += wy[j] * (wx[0] * from[columns[0]] + wx[1] * from[columns[1]] + wx[2] * from[columns[2]] +
                            wx[3] * from[columns[3]]);
          }
          out.image.channel(c)[at] = sum;
        }
        Unpremultiply(out.image, at);
        bool ignored = false;
        for (size_t j = 1; j < 3 && !picture.ignored.empty(); ++j) {
          for (size_t i = 1; i < 3; ++i) {
            ignored |= picture.ignored[static_cast<size_t>(int64_t{rows[j]} * width + columns[i])] != 0;
          }
        }
        out.ignored[static_cast<size_t>(at)] = ignored;
      }
    }
  });
  if (!AnyIgnored(out.ignored)) out.ignored.clear();
  return out;
}

Pinhole Downscaled(const Pinhole& k, int factor) {
  const double f = factor;
  return {k.width / factor, k.height / factor, k.fx / f, k.fy / f, k.cx / f, k.cy / f};
}

ViewPicture Downscaled(const ViewPicture& picture, int factor) {
  const Image source = Premultiplied(picture.image);
  const int width = source.width / factor, height = source.height / factor;
  ViewPicture out{Image(width, height, source.channels), {}};
  if (!picture.ignored.empty()) out.ignored = Buffer<uint8_t>(static_cast<size_t>(int64_t{width} * height));
  const float share = 1 / (static_cast<float>(factor) * static_cast<float>(factor));
  ParallelFor(0, height, kRowsPerTask, [&](int64_t first, int64_t last) {
    for (int64_t y = first; y < last; ++y) {
      for (int x = 0; x < width; ++x) {
        const int64_t at = y * width + x, corner = y * factor * source.width + int64_t{x} * factor;
        for (int c = 0; c < source.channels; ++c) {
          float sum = 0;
          for (int j = 0; j < factor; ++j) {
            const float* from = source.channel(c) + corner + int64_t{j} * source.width;
            for (int i = 0; i < factor; ++i) sum += from[i];
          }
          out.image.channel(c)[at] = sum * share;
        }
        Unpremultiply(out.image, at);
        bool ignored = false;
        for (int j = 0; j < factor && !picture.ignored.empty(); ++j) {
          const uint8_t* from = picture.ignored.data() + corner + int64_t{j} * source.width;
          ignored |= std::any_of(from, from + factor, [](uint8_t value) { return value != 0; });
        }
        if (!out.ignored.empty()) out.ignored[static_cast<size_t>(at)] = ignored;
      }
    }
  });
  return out;
}

}  // namespace anchorsplat

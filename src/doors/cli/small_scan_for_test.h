#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/gaussian_cloud.h"
#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "fit/orbit_scene_for_test.h"
#include "formats/cloud_io.h"
#include "io/file_bytes_for_test.h"

namespace anchorsplat {

// For tests: what verbs are given, small enough that each is done in milliseconds.

// A ball of `n` coloured Gaussians with harmonics of `degree`.
inline GaussianCloud SmallScan(int64_t n, int degree) {
  const GaussianCloud ball = orbit_scene::Ball(n, 5);
  GaussianCloud scan = ball;
  scan.Resize(n, degree);
  scan.means = ball.means;
  scan.log_scales = ball.log_scales;
  scan.quats = ball.quats;
  scan.opacity_logits = ball.opacity_logits;
  Random random(6);
  const size_t width = scan.sh.size() / static_cast<size_t>(n);
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    for (size_t k = 0; k < width; ++k) {
      scan.sh[i * width + k] = k < 3 ? ball.sh[3 * i + k] : static_cast<float>(random.Uniform(-0.1, 0.1));
    }
  }
  return scan;
}

inline std::string WriteScan(const std::filesystem::path& path, int64_t n = 200, int degree = 1) {
  EXPECT_TRUE(WriteCloud(path, SmallScan(n, degree)).ok()) << path;
  return path;
}

// A file whose header promises `n` Gaussians of degree 3 and that is as long as that; it takes no room on disk.
inline std::string WriteHugeScan(const std::filesystem::path& path, int64_t n) {
  WriteScan(path, 1, 3);
  std::string text = FileBytes(path);
  const std::string one = "element vertex 1\n";
  text.replace(text.find(one), one.size(), "element vertex " + std::to_string(n) + "\n");
  text.resize(text.find("end_header\n") + 11);
  std::ofstream(path, std::ios::binary) << text;
  std::filesystem::resize_file(path, text.size() + 248 * static_cast<uint64_t>(n));
  return path;
}

// transforms.json and views/000.png … 009.png of the ball, 48 pixels wide.
inline std::string WriteProject(const std::filesystem::path& folder) {
  orbit_scene::Write(folder, orbit_scene::Ball(200, 5), 10, 48);
  return folder;
}

// What the examples have: a splat of 20,000 Gaussians of degree 3, with the cameras it was trained with and others.
inline std::filesystem::path Biplane() { return SourceDirForTest() / "examples/biplane"; }

// Two Gaussians of which nothing is known.
inline std::string WriteNanScan(const std::filesystem::path& path) {
  std::ofstream out(path);
  out << "ply\nformat ascii 1.0\nelement vertex 2\n";
  for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                           "rot_0", "rot_1", "rot_2", "rot_3"}) {
    out << "property float " << name << '\n';
  }
  out << "end_header\n";
  for (int i = 0; i < 2; ++i) out << "0 nan 0 0 0 0 0 -5 -5 -5 1 0 0 0\n";
  return path;
}

}  // namespace anchorsplat

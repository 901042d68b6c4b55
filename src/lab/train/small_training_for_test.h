#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "dataset/object_builder.h"
#include "dataset/object_record.h"
#include "io/folder_for_test.h"

namespace anchorsplat::test {

// A data set of small coloured tetrahedra in three views of 64² pixels, made in a second or two: "a" and "b" in train/,
// "c" in validation/.
class SmallTrainingSet {
 public:
  SmallTrainingSet() {
    Add("train", "a", 0.2);
    Add("train", "b", 0.6);
    Add("validation", "c", 0.9);
  }
  std::filesystem::path train() const { return folder_ / "train"; }
  std::filesystem::path validation() const { return folder_ / "validation"; }
  std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }

  // Writes a recipe that runs in seconds, with `more` lines at its end.
  std::filesystem::path Config(const std::string& name, const std::string& more) const {
    const std::filesystem::path path = folder_ / name;
    std::ofstream(path) << R"(
log_every = 1
checkpoint_every = 0
[network]
kind = "anchorsplat"
copies = 2
encoder_channels = [8, 12]
encoder_blocks = [1, 1]
decoder_channels = [8]
decoder_blocks = [1]
head_hidden = 16
drop_path = 0.1
[data]
views_per_object = 4
views_per_step = 2
)" << more;
    return path;
  }

 private:
  void Add(const std::string& set, const std::string& name, double red) {
    const std::filesystem::path mesh = folder_ / (name + ".obj");
    std::ofstream(mesh) << "mtllib " << name << ".mtl\nv 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 " << 1 + red
                        << "\nusemtl m0\nf 1 2 3\nusemtl m1\nf 1 4 2\nusemtl m2\nf 1 3 4\nusemtl m3\nf 2 4 3\n";
    std::ofstream materials(folder_ / (name + ".mtl"));
    for (int i = 0; i < 4; ++i) {
      materials << "newmtl m" << i << "\nKd " << red << ' ' << 0.25 * i << ' ' << 1 - 0.3 * i << "\n";
    }
    materials.close();
    ObjectJob job;
    job.name = name;
    job.source = mesh.string();
    job.recipe = "small";
    job.settings.views.rig.views = 10;
    job.settings.views.low_size = 16;
    job.settings.views.high_size = 64;
    job.settings.views.points = 150;
    job.settings.views.store_high = name != "b";  // "b" exercises the folder of true views
    job.settings.fit_steps = 500;
    job.settings.max_gaussians = 300;
    job.settings.min_train_psnr = 1;
    const auto record = BuildObject(job, folder_ / set);
    if (!record.ok()) throw std::runtime_error(record.error().message);
  }

  TestFolder folder_;
};

}  // namespace anchorsplat::test

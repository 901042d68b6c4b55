#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "dataset/object_builder.h"
#include "dataset/object_record.h"

namespace anchorsplat {

// Writes a tetrahedron of four colours as OBJ and MTL.
inline std::string WriteTetrahedron(const std::filesystem::path& folder, const std::string& name) {
  std::ofstream mesh(folder / (name + ".obj"));
  mesh << "mtllib " << name << ".mtl\nv 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\n";
  const char* faces[] = {"1 2 3", "1 4 2", "1 3 4", "2 4 3"};
  std::ofstream materials(folder / (name + ".mtl"));
  for (int i = 0; i < 4; ++i) {
    mesh << "usemtl m" << i << "\nf " << faces[i] << "\n";
    materials << "newmtl m" << i << "\nKd " << (i == 0 ? 1 : 0.2) << ' ' << (i == 1 ? 1 : 0.3) << ' '
              << (i == 2 ? 1 : 0.4) << "\n";
  }
  return (folder / (name + ".obj")).string();
}

// An object that takes a second to build.
inline ObjectJob SmallJob(const std::string& mesh, const std::string& name) {
  ObjectJob job;
  job.name = name;
  job.source = mesh;
  job.recipe = "small";
  job.settings.views.rig.views = 9;
  job.settings.views.low_size = 12;
  job.settings.views.high_size = 24;
  job.settings.views.points = 60;
  job.settings.fit_steps = 60;
  job.settings.max_gaussians = 300;
  job.settings.min_train_psnr = 1;
  return job;
}

}  // namespace anchorsplat

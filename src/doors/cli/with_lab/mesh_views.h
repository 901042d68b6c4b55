#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "cli/verb.h"
#include "core/result.h"
#include "scene/view_set.h"

namespace anchorsplat {

// Options of verbs that render views of a mesh.
struct ViewSetFlags {
  ViewSetOptions views;
  std::string background;  // "R,G,B"; empty: black

  void AddTo(CLI::App& verb);
  Result<ViewSetOptions> Options(const SharedFlags& shared) const;
};

}  // namespace anchorsplat

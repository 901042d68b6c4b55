#include "cli/with_lab/mesh_views.h"

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/clean_output.h"
#include "cli/help.h"
#include "cli/verb.h"
#include "core/log.h"
#include "core/text.h"
#include "request/choice.h"
#include "request/parse.h"
#include "scene/mesh_reader.h"

namespace anchorsplat {

namespace {

struct ViewsFlags {
  std::string mesh;
  std::string output;
  ViewSetFlags views;
};

nlohmann::json CostToJson(const ViewSetCost& cost) {
  return {{"seconds", cost.seconds},
          {"rays", cost.low.rays + cost.high.rays},
          {"ray_seconds", cost.low.ray_seconds + cost.high.ray_seconds},
          {"shade_seconds", cost.low.shade_seconds + cost.high.shade_seconds},
          {"picture_seconds", cost.picture_seconds},
          {"point_seconds", cost.point_seconds}};
}

Status RunViews(const ViewsFlags& flags, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewSetOptions options, flags.views.Options(shared));
  ANCHORSPLAT_RETURN_IF_ERROR(MakeViewSetCameras(options));  // complains before anything is read
  ANCHORSPLAT_ASSIGN_OR_RETURN(ImportedMesh imported, ReadMesh(flags.mesh));
  for (const std::string& warning : imported.warnings) LogWarning(Cat(flags.mesh, ": ", warning));
  const DroppedTriangles dropped = DropInvisibleTriangles(imported.mesh);
  auto normalized = NormalizedToUnitCube(std::move(imported.mesh));
  if (!normalized.ok()) return Error{ErrorCode::kBadFile, Cat(flags.mesh, ": ", normalized.error().message)};
  auto tracer = RayTracer::Create(*std::move(normalized));
  if (!tracer.ok()) return Error{tracer.error().code, Cat(flags.mesh, ": ", tracer.error().message)};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewSetCost cost, WriteViewSet(*tracer, flags.output, options));

  const Mesh& mesh = tracer->mesh();
  if (shared.json) {
    PrintJson({{"mesh", flags.mesh},
               {"output", flags.output},
               {"name", imported.origin.name},
               {"licence", imported.origin.licence},
               {"creator", imported.origin.creator},
               {"triangles", mesh.triangles.size()},
               {"dropped", {{"transparent", dropped.transparent}, {"degenerate", dropped.degenerate}}},
               {"textures", mesh.textures.size()},
               {"views", options.rig.views},
               {"sizes", {options.low_size, options.high_size}},
               {"cost", CostToJson(cost)}});
  } else if (!shared.quiet) {
    const double rays = static_cast<double>(cost.low.rays + cost.high.rays);
    const double seconds = cost.low.ray_seconds + cost.high.ray_seconds;
    std::cout << options.rig.views << (options.rig.views == 1 ? " view of " : " views of ")
              << WithThousands(std::ssize(mesh.triangles)) << " triangles at " << options.low_size << " and "
              << options.high_size << " pixels in " << HumanSeconds(cost.seconds) << " to " << OneLine(flags.output)
              << '\n'
              << "processor time: rays " << HumanSeconds(seconds) << " (" << Fixed(rays / 1e6, 0) << " million, "
              << Fixed(seconds > 0 ? rays / seconds / 1e6 : 0, 0) << " million a second and thread), shading "
              << HumanSeconds(cost.low.shade_seconds + cost.high.shade_seconds) << ", PNG "
              << HumanSeconds(cost.picture_seconds) << '\n';
  }
  return {};
}

}  // namespace

void ViewSetFlags::AddTo(CLI::App& verb) {
  verb.add_option("--views", views.rig.views, "Cameras around the object")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  verb.add_option("--size", views.high_size, "Pixels per side of the high-resolution views")
      ->check(CLI::Range(1, 16384))
      ->capture_default_str();
  verb.add_option("--low-size", views.low_size, "Pixels per side of the low-resolution views")
      ->check(CLI::Range(1, 16384))
      ->capture_default_str();
  verb.add_option("--fov", views.rig.fov_degrees, "Field of view, degrees")
      ->check(CLI::Range(1.0, 170.0))
      ->capture_default_str();
  verb.add_option("--radius", views.rig.radius, "Distance of the cameras; the object's longest side is 1")
      ->check(Positive())
      ->capture_default_str();
  AddChoice<RigKind>(verb, "--rig", views.rig.kind,
                     {{"sphere", RigKind::kSphere}, {"rings", RigKind::kRings}, {"random", RigKind::kRandom}},
                     "Where the cameras stand: a Fibonacci sphere, rings, or random by --seed");
  verb.add_option("--elevations", views.rig.elevations, "Rings: degrees above the horizon")
      ->delimiter(',')
      ->check(CLI::Range(-90.0, 90.0))
      ->capture_default_str();
  verb.add_option("--samples", views.trace.samples, "Rays per pixel and side: 4 is 16 rays a pixel")
      ->check(CLI::Range(1, kMaxTraceSamples))
      ->capture_default_str();
  verb.add_option("--points", views.points, "Surface samples to start a fit from")
      ->check(CLI::Range(0, 10'000'000))
      ->capture_default_str();
  verb.add_option("--background", background, "R,G,B from 0 to 1 (default: black)")->type_name("R,G,B");
  verb.add_flag("--opaque", views.opaque, "Write RGB over the background instead of RGBA");
  AddChoice<bool>(verb, "--hr", views.store_high, {{"stored", true}, {"on-demand", false}},
                  "Whether to write the high-resolution pictures");
}

Result<ViewSetOptions> ViewSetFlags::Options(const SharedFlags& shared) const {
  ViewSetOptions options = views;
  if (!background.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.background, ParseColor("--background", background));
  }
  options.seed = options.rig.seed = shared.seed;
  options.overwrite = shared.overwrite;
  return options;
}

void AddViews(CLI::App& app, Program& program) {
  CLI::App& verb =
      AddVerb(app, program, "views", "Render a mesh to the low- and high-resolution views of the benchmark",
              "anchorsplat views chair.obj -o chair/ --views 146 --size 1024 --low-size 256");
  const auto flags = std::make_shared<ViewsFlags>();
  verb.add_option("mesh", flags->mesh, "Mesh file, or catalog.sh3f#object")->required()->check(NotEmpty());
  verb.add_option("-o,--output", flags->output, "Folder for the views")
      ->type_name("FOLDER")
      ->required()
      ->check(NotEmpty());
  flags->views.AddTo(verb);
  ShortenHelp(verb, {"--output", "--views", "--size", "--low-size", "--rig", "--background", "--opaque", "--overwrite",
                     "--quiet", "--json"});
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunViews(*flags, program.flags); }; });
}

}  // namespace anchorsplat

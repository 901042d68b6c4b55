#include "request/refine_flags.h"

#include "cameras/photograph.h"
#include "request/choice.h"

namespace anchorsplat {

void AddRefineFlags(CLI::App& verb, RefineOptions& options, RefineControl& control) {
  const std::string group = kRefineGroup;
  const auto path = [](std::filesystem::path& value) { return [&value](const std::string& text) { value = text; }; };
  verb.add_option_function<std::string>(
          "--images", path(options.images),
          "Project with the training pictures (as for `fit`): the best reference for refinement")
      ->type_name("PROJECT")
      ->check(NotEmpty())
      ->group(group);
  verb.add_option_function<std::string>(
          "--enlarge-with", path(options.enlarge_with),
          "With --method detail: network that adds detail to the reference, a .safetensors of "
          "scripts/fetch-upscaler.sh")
      ->type_name("FILE")
      ->check(NotEmpty())
      ->group(group);
  verb.add_option("--hold-out", options.hold_out,
                  "With --images: hold out every Nth view; 0: none (default: 8, or 0 if the splat seems fitted to all)")
      ->check(CLI::Range(0, 1 << 30))
      ->group(group);
  verb.add_option("--downscale", options.downscale,
                  "With --images: average N x N pixels, if the splat was fitted to smaller pictures")
      ->check(CLI::Range(1, kMaxDownscale))
      ->capture_default_str()
      ->group(group);
  auto* steps =
      verb.add_option("--steps", options.steps,
                      "Steps (default: 1500 with --images; without: 600, after a network 100; with --method detail: "
                      "300)")
          ->check(CLI::Range(int64_t{1}, int64_t{1} << 40))
          ->group(group);
  verb.add_option("--seconds", options.seconds, "Run for this time instead of --steps; not reproducible")
      ->check(Positive())
      ->excludes(steps)
      ->group(group);
  verb.add_option("--k", options.copies,
                  "Split each Gaussian into so many first (default: 8 with --images; without: 4, after a network 1; "
                  "with --method "
                  "detail: 1; fewer if the closer view has too few pixels)")
      ->check(CLI::Range(1, kMostCopies))
      ->group(group);
  verb.add_option("--poses", options.poses, "Without --images and --cameras: views around the object")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str()
      ->group(group);
  verb.add_option("--between", options.between,
                  "With --cameras, without --images: extra views per camera, half-way to its neighbours")
      ->check(CLI::Range(0, 64))
      ->capture_default_str()
      ->group(group);
  verb.add_option("--half-from", options.half_from, "Fraction of the run after which half of the rays are rendered")
      ->check(Fraction())
      ->capture_default_str()
      ->group(group);
  verb.add_option("--all-from", options.all_from, "Fraction of the run after which all rays are rendered")
      ->check(Fraction())
      ->capture_default_str()
      ->group(group);
  verb.add_option(
          "--rate", options.rate,
          "Factor on the learning rates of `fit` (default: 1; after a network without --images: 0.1; with --method "
          "detail: 0.3)")
      ->check(Positive())
      ->group(group);
  verb.add_option("--rate-decay", options.rate_decay, "Factor on --rate by the end of the run")
      ->check(Fraction())
      ->capture_default_str()
      ->group(group);
  verb.add_option("--ssim-weight", options.ssim_weight, "w of the loss (1 - w) L1 + w (1 - SSIM)")
      ->check(Fraction())
      ->capture_default_str()
      ->group(group);
  verb.add_flag("--exposure", options.exposure, "Fit brightness and tint of each picture of --images")->group(group);
  verb.add_flag("--robust", options.robust, "Ignore gross differences from --images: passers-by, flares")->group(group);
  verb.add_flag("--align", options.align, "Optimise the poses of --images, too")->group(group);
  verb.add_option_function<std::string>(
          "--checkpoint", path(control.checkpoint),
          "File to resume from (default: OUTPUT.checkpoint); a network writes one only with this or --resume")
      ->type_name("FILE")
      ->check(NotEmpty())
      ->group(group);
  verb.add_option("--checkpoint-every", control.checkpoint_every,
                  "Refinement steps between checkpoints; 0: only when interrupted")
      ->check(NotNegative())
      ->capture_default_str()
      ->group(group);
  verb.add_flag("--resume", control.resume, "Continue from the checkpoint, if there is one")->group(group);
}

}  // namespace anchorsplat

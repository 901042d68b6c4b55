#include "request/refine_flags.h"

#include "cameras/photograph.h"
#include "request/choice.h"

namespace anchorsplat {

void AddRefineFlags(CLI::App& verb, RefineOptions& options, RefineControl& control) {
  const std::string group = kRefineGroup;
  const auto path = [](std::filesystem::path& value) { return [&value](const std::string& text) { value = text; }; };
  verb.add_option_function<std::string>(
          "--images", path(options.images),
          "Project with the pictures it was fitted to (as of `fit`): the best there is to refine against")
      ->check(NotEmpty())
      ->group(group);
  verb.add_option_function<std::string>("--enlarge-with", path(options.enlarge_with),
                                        "Of --method detail: a network's .safetensors "
                                        "(scripts/fetch-upscaler.sh) that enlarges what is compared with")
      ->check(NotEmpty())
      ->group(group);
  verb.add_option("--hold-out", options.hold_out,
                  "Of --images: every Nth view is not trained on; 0: all are (default: 8, or 0 where the splat was "
                  "fitted to all of them, as it looks)")
      ->check(CLI::Range(0, 1 << 30))
      ->group(group);
  verb.add_option("--downscale", options.downscale,
                  "Of --images: N x N pixels become one, where the splat was fitted to smaller pictures")
      ->check(CLI::Range(1, kMostDownscale))
      ->capture_default_str()
      ->group(group);
  auto* steps = verb.add_option("--steps", options.steps,
                                "Steps (default: 1500 with --images, 600 without, 100 of a network's result without; "
                                "300 of --method detail)")
                    ->check(CLI::Range(int64_t{1}, int64_t{1} << 40))
                    ->group(group);
  verb.add_option("--seconds", options.seconds,
                  "As many steps as there are in that time; then the result is not the same each time")
      ->check(Positive())
      ->excludes(steps)
      ->group(group);
  verb.add_option(
          "--k", options.copies,
          "Gaussians that each becomes at first (default: 8 of the input's with --images, 4 without, 1 of a network's "
          "result without and of --method detail; fewer where a closer view has no room for more)")
      ->check(CLI::Range(1, kMostCopies))
      ->group(group);
  verb.add_option("--poses", options.poses, "Without --images and --cameras: places around the object to look from")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str()
      ->group(group);
  verb.add_option("--between", options.between, "With --cameras, without --images: poses towards so many neighbours")
      ->check(CLI::Range(0, 64))
      ->capture_default_str()
      ->group(group);
  verb.add_option("--half-from", options.half_from, "Part of the run from which on half of the rays are rendered")
      ->check(Fraction())
      ->capture_default_str()
      ->group(group);
  verb.add_option("--all-from", options.all_from, "Part of the run from which on all rays are rendered")
      ->check(Fraction())
      ->capture_default_str()
      ->group(group);
  verb.add_option("--rate", options.rate,
                  "Learning rates, as a part of those of `fit` (default: 1; 0.1 of a network's result without "
                  "--images; 0.3 of --method detail)")
      ->check(Positive())
      ->group(group);
  verb.add_option("--rate-decay", options.rate_decay, "What is left of them at the end")
      ->check(Fraction())
      ->capture_default_str()
      ->group(group);
  verb.add_option("--ssim-weight", options.ssim_weight, "w of the loss (1 - w) L1 + w (1 - SSIM)")
      ->check(Fraction())
      ->capture_default_str()
      ->group(group);
  verb.add_flag("--exposure", options.exposure, "Pictures of --images differ in brightness and tint")->group(group);
  verb.add_flag("--robust", options.robust, "Ignore what differs grossly from --images: passers-by, flares")
      ->group(group);
  verb.add_flag("--align", options.align, "Poses of --images are a little off: optimise them, too")->group(group);
  verb.add_option_function<std::string>(
          "--checkpoint", path(control.checkpoint),
          "State to resume from (default: OUTPUT.checkpoint); of a network only where this or --resume "
          "is given")
      ->check(NotEmpty())
      ->group(group);
  verb.add_option("--checkpoint-every", control.checkpoint_every,
                  "Of refinement: steps between checkpoints; 0: only when interrupted")
      ->check(NotNegative())
      ->capture_default_str()
      ->group(group);
  verb.add_flag("--resume", control.resume, "Go on from the checkpoint if there is one")->group(group);
}

}  // namespace anchorsplat

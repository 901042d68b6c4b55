#pragma once

#include "compact/compact_network.h"
#include "core/result.h"
#include "enhance/enhance.h"

namespace anchorsplat {

// The method "model", configured by EnhanceOptions::model. "auto" prefers it to the filter when a network is available.
// Caches the last network it loaded.
EnhanceMethod ModelMethod();
// Every method of this program: those of enhance/enhance.h, and "model". Built once.
const std::vector<EnhanceMethod>& AllMethods();

// Enhances a splat with a compact network. Writes a summary to the log and to report.facts: "copies",
// "unlike_training", "partly_unlike_training", "output_not_finite", "blocks_resumed", "copies_made", "merged",
// "unseen", "pruned", "left_out", and "seconds_…" per stage.
//
// The splat is returned unchanged when input.filter_strength is at most what the closer view's own pixels add
// (ShownStrength): it has no lost width to restore. Splats whose kind the network was not trained for are filtered: a
// network without `knows_kind` knows only classic ones.
//
// `model`: only the settings that choose among copies are used. `control`: where finished blocks are saved for resuming
// (compact/compact_checkpoint.h). `stand_in`: see CompactTask.
// Errors: kBadFile if no output of the network is finite; kBadArgument as Validate(CopyChoice).
Result<GaussianCloud> EnhanceWithCompactNetwork(EnhanceInput input, double upscale, const CompactNetwork& network,
                                                const ModelSettings& model, StepReport& report,
                                                const RefineControl& control = {},
                                                const CompactNetwork* stand_in = nullptr);

}  // namespace anchorsplat

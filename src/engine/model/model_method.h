#pragma once

#include "core/result.h"
#include "enhance/enhance.h"
#include "model/compact/compact_network.h"

namespace anchorsplat {

// The method "model", which "auto" prefers to the filter where there is a network. What it works with is
// EnhanceOptions::model; the last network is kept with the method for the next call.
EnhanceMethod ModelMethod();
// All that this program has, made once: those of enhance/enhance.h, and "model".
const std::vector<EnhanceMethod>& AllMethods();

// Enhances by a compact network, with a word in the log and in report.facts ("copies", "unlike_training",
// "partly_unlike_training", "output_not_finite", "blocks_resumed", "copies_made", "merged", "unseen", "pruned",
// "left_out", and "seconds_…" of its stages). Of `model` it looks at what chooses among its copies. kBadFile: it says
// nothing finite about any Gaussian; kBadArgument: of ChooseCopies. A strength of no more than the closer view's own
// pixels add means that there is no lost width to build on (a splat that is seen no closer, or has its width): it stays
// as it is. A network that is not told the kind of splat knows classic ones; others are filtered. `control`: what its
// blocks make is kept there (model/compact/compact_checkpoint.h). `stand_in`: see CompactTask.
Result<GaussianCloud> EnhanceWithCompactNetwork(EnhanceInput input, double upscale, const CompactNetwork& network,
                                                const ModelSettings& model, StepReport& report,
                                                const RefineControl& control = {},
                                                const CompactNetwork* stand_in = nullptr);

}  // namespace anchorsplat

#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/result.h"
#include "eval/evaluation.h"
#include "eval/summary.h"

namespace anchorsplat {

// Tables of an evaluation in Markdown under `title`: all objects, kinds if there are several, and each object. `seed`:
// as for Summarise.
std::string ToMarkdown(const Evaluation& evaluation, const std::vector<MethodSummary>& summaries,
                       const std::string& title, uint64_t seed = 0);
// One line with the largest loss of any method on any object against the unchanged splat; empty without raw.
std::string WorstSentence(const Evaluation& evaluation);
// One line per object and method.
std::string ToCsv(const Evaluation& evaluation);
// Everything including views. Infinite PSNR becomes null.
nlohmann::json ToJson(const Evaluation& evaluation, const std::vector<MethodSummary>& summaries, uint64_t seed = 0);

// Writes out/table.md, table.csv, results.json and contact_sheet.png, replacing existing ones.
Status WriteReports(const std::filesystem::path& out, const Evaluation& evaluation,
                    const std::vector<MethodSummary>& summaries, const std::string& title, uint64_t seed = 0);

}  // namespace anchorsplat

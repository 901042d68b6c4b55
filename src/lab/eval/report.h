#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/result.h"
#include "eval/evaluation.h"
#include "eval/summary.h"

namespace anchorsplat {

// The tables of an evaluation: all objects, kinds where there are several (`seed` as of Summarise), and object by
// object. `title` stands above the Markdown.
std::string ToMarkdown(const Evaluation& evaluation, const std::vector<MethodSummary>& summaries,
                       const std::string& title, uint64_t seed = 0);
// The largest loss of any method on any object against the splat as it is, in one line; empty where raw is missing.
std::string WorstSentence(const Evaluation& evaluation);
// A line per object and method.
std::string ToCsv(const Evaluation& evaluation);
// Everything, views included. Infinite PSNR is null.
nlohmann::json ToJson(const Evaluation& evaluation, const std::vector<MethodSummary>& summaries, uint64_t seed = 0);

// out/table.md, table.csv, results.json and contact_sheet.png; earlier ones are replaced.
Status WriteReports(const std::filesystem::path& out, const Evaluation& evaluation,
                    const std::vector<MethodSummary>& summaries, const std::string& title, uint64_t seed = 0);

}  // namespace anchorsplat

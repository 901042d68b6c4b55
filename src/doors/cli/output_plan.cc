#include "cli/output_plan.h"

#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <system_error>

#include "core/file_system.h"
#include "core/log.h"
#include "core/memory_limit.h"
#include "core/text.h"
#include "request/choice.h"
#include "request/parse.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Smaller and quicker outputs need no announcement.
constexpr uint64_t kWorthAWord = 100'000'000;
constexpr double kLongWait = 5;

bool IsYes(const std::string& answer) { return answer == "y" || answer == "Y" || answer == "yes"; }

}  // namespace

void SizeFlags::AddTo(CLI::App& verb) {
  const std::string group = "Large splats";
  verb.add_option("--max-memory", max_memory,
                  "Memory for large arrays, such as 2G or 500M; the rest goes to temporary files beside the output "
                  "(default: a quarter of the machine's)")
      ->transform(MemorySize())
      ->group(group);
  verb.add_flag("--yes", yes, "Do not ask before writing more than 4 GB or than the disk has room for")->group(group);
}

uint64_t SizeFlags::memory() const { return max_memory > 0 ? max_memory : DefaultMaxMemory(); }

uint64_t DefaultMaxMemory() { return std::max(MachineMemory() / 4, kLeastMemory); }

std::optional<uint64_t> RoomFor(const fs::path& output) {
  std::error_code failed;
  fs::path folder = fs::absolute(output, failed).parent_path();
  if (failed) return std::nullopt;
  while (!Exists(folder) && folder.has_relative_path()) folder = folder.parent_path();
  const fs::space_info space = fs::space(folder, failed);
  return failed || space.capacity == 0 ? std::nullopt : std::optional(static_cast<uint64_t>(space.available));
}

namespace {

uint64_t TemporaryBytes(const OutputPlan& plan, const SizeFlags& flags) {
  return plan.needed > flags.arrays() ? plan.needed - flags.arrays() : 0;
}

// One output, as a sentence.
std::string Spoken(const OutputPlan& plan, const SizeFlags& flags) {
  const uint64_t temporary = TemporaryBytes(plan, flags);
  const bool grows = plan.gaussians > plan.gaussians_in;
  std::string text = Cat(plan.input, ": ", WithThousands(plan.gaussians_in), " Gaussians");
  if (plan.gaussians != plan.gaussians_in) {
    text += Cat(" become ", grows ? "up to " : "", WithThousands(plan.gaussians));
  }
  text += Cat("; ", plan.output.string(), " takes ", grows ? "up to " : "", plan.roughly ? "about " : "",
              HumanBytes(plan.bytes));
  if (plan.seconds) text += Cat(", in about ", HumanSeconds(std::max(1.0, *plan.seconds)));
  if (temporary > 0)
    text += Cat(", with up to ", HumanBytes(temporary), " of temporary files beside it (--max-memory)");
  return text;
}

}  // namespace

void Say(const OutputPlan& plan, const SizeFlags& flags) {
  if (plan.bytes >= kWorthAWord || plan.seconds.value_or(0) >= kLongWait) LogInfo(Spoken(plan, flags));
}

Result<bool> AskIfLarge(std::span<const OutputPlan> plans, const SizeFlags& flags, const SharedFlags& shared) {
  if (plans.empty()) return false;
  // Outputs add up; temporary files are removed before the next. All are in one folder.
  uint64_t bytes = 0, temporary = 0;
  for (const OutputPlan& plan : plans) {
    bytes += plan.bytes;
    temporary = std::max(temporary, TemporaryBytes(plan, flags));
  }
  std::string why;
  const std::string what = plans.size() > 1 ? Cat("all ", plans.size(), " together take ", HumanBytes(bytes)) : "";
  const std::optional<uint64_t> room = RoomFor(plans.front().output);
  if (room && bytes + temporary > *room) {
    why = Cat(what, what.empty() ? "" : ", and ", "the disk has room for ", HumanBytes(*room));
  } else if (bytes > kLargeOutput) {
    why = Cat(what.empty() ? "that is" : what + ",", " more than ", HumanBytes(kLargeOutput));
  }
  const bool can_ask = ::isatty(STDIN_FILENO) == 1 && ::isatty(STDERR_FILENO) == 1 && !shared.quiet && !shared.json &&
                       !shared.json_progress;
  if (!why.empty() && !flags.yes && !can_ask) {
    const auto largest = std::ranges::max_element(plans, {}, &OutputPlan::bytes);
    return Error{ErrorCode::kBadArgument, Cat(Spoken(*largest, flags), "; ", why,
                                              ". Nothing was written; pass --yes to write it anyway, or "
                                              "--max-gaussians N to make it smaller")};
  }
  if (why.empty()) return false;
  for (const OutputPlan& plan : plans) LogInfo(Spoken(plan, flags));
  if (flags.yes) return true;
  std::cerr << why << ". Continue? [y/N] " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  if (IsYes(answer)) return true;
  return Error{ErrorCode::kBadArgument, Cat(plans.front().output.string(), ": not written: the answer was not yes")};
}

Status SayAndAsk(std::span<const OutputPlan> plans, const SizeFlags& flags, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const bool said, AskIfLarge(plans, flags, shared));
  for (const OutputPlan& plan : plans) {
    if (!said) Say(plan, flags);
  }
  return {};
}

}  // namespace anchorsplat

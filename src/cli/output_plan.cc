#include "cli/output_plan.h"

#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <system_error>

#include "core/log.h"
#include "core/memory_limit.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr uint64_t kLeastMemory = 64'000'000;
// What is smaller and quicker is there before anybody has read what it will be.
constexpr uint64_t kWorthAWord = 100'000'000;
constexpr double kLongWait = 5;

// Nothing where the system does not say, nor where nothing can be stored at all (/proc), which writing says better.
std::optional<uint64_t> RoomIn(const fs::path& folder) {
  std::error_code failed;
  const fs::space_info space = fs::space(folder.empty() ? fs::path(".") : folder, failed);
  return failed || space.capacity == 0 ? std::nullopt : std::optional(static_cast<uint64_t>(space.available));
}

bool IsYes(const std::string& answer) { return answer == "y" || answer == "Y" || answer == "yes"; }

}  // namespace

void SizeFlags::AddTo(CLI::App& verb) {
  const std::string group = "Large splats";
  verb.add_option("--max-memory", max_memory,
                  "Memory to work in, as 2G or 500M; what needs more lies in temporary files beside the output "
                  "(default: a quarter of the machine's)")
      ->transform(CLI::AsSizeValue(/*kb_is_1000=*/true))
      ->group(group);
  verb.add_flag("--yes", yes, "Do not ask before files of more than 4 GB, or more than the disk has room for")
      ->group(group);
}

uint64_t SizeFlags::memory() const { return max_memory > 0 ? std::max(max_memory, kLeastMemory) : DefaultMaxMemory(); }

uint64_t DefaultMaxMemory() { return std::max(MachineMemory() / 4, kLeastMemory); }

Status SayAndAsk(const OutputPlan& plan, const SizeFlags& flags, const SharedFlags& shared) {
  const uint64_t temporary = plan.needed > flags.arrays() ? plan.needed - flags.arrays() : 0;
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

  const std::optional<uint64_t> room = RoomIn(plan.output.parent_path());
  std::string why;
  if (room && plan.bytes + temporary > *room) {
    why = Cat("the disk has room for ", HumanBytes(*room));
  } else if (plan.bytes > kLargeOutput) {
    why = Cat("that is more than ", HumanBytes(kLargeOutput));
  }
  const bool can_ask = ::isatty(STDIN_FILENO) == 1 && ::isatty(STDERR_FILENO) == 1 && !shared.quiet && !shared.json &&
                       !shared.json_progress;
  if (!why.empty() && !flags.yes && !can_ask) {
    return Error{ErrorCode::kBadArgument, Cat(text, "; ", why,
                                              ": nothing was done. --yes does it all the same; --max-gaussians N "
                                              "makes it smaller")};
  }
  if (!why.empty() || plan.bytes >= kWorthAWord || plan.seconds.value_or(0) >= kLongWait) LogInfo(text);
  if (why.empty() || flags.yes) return {};
  std::cerr << why << ". Go on? [y/N] " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  if (IsYes(answer)) return {};
  return Error{ErrorCode::kBadArgument, Cat(plan.output.string(), ": not written, as nobody said yes")};
}

}  // namespace anchorsplat

#include "cli/output_plan.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iostream>
#include <string_view>
#include <system_error>

#include "core/file_system.h"
#include "core/log.h"
#include "core/memory_limit.h"
#include "core/number_text.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// What is smaller and quicker is there before anybody has read what it will be.
constexpr uint64_t kWorthAWord = 100'000'000;
constexpr double kLongWait = 5;

bool IsYes(const std::string& answer) { return answer == "y" || answer == "Y" || answer == "yes"; }

}  // namespace

void SizeFlags::AddTo(CLI::App& verb) {
  const std::string group = "Large splats";
  verb.add_option("--max-memory", max_memory,
                  "Memory to work in, as 2G or 500M; what needs more lies in temporary files beside the output "
                  "(default: a quarter of the machine's)")
      ->transform(CLI::Validator(
          [](std::string& text) {
            const Result<uint64_t> bytes = ParseMemory(text);
            if (bytes.ok()) text = std::to_string(*bytes);
            return bytes.ok() ? std::string() : bytes.error().message;
          },
          "SIZE"))
      ->group(group);
  verb.add_flag("--yes", yes, "Do not ask before files of more than 4 GB, or more than the disk has room for")
      ->group(group);
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

Result<uint64_t> ParseMemory(const std::string& text) {
  const Error bad{ErrorCode::kBadArgument, Cat("'", Printable(text), "' is no size; expected one as 2G, 500M or 0.5G")};
  double number = 0;
  const char* const last = text.data() + text.size();
  const auto [end, code] = FromChars(text.data(), last, number);
  if (code != std::errc() || !std::isfinite(number)) return bad;
  std::string unit(end, last);
  std::ranges::transform(unit, unit.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  unit.erase(0, unit.find_first_not_of(' '));
  const bool binary = unit.size() == 3 && unit.ends_with("ib");
  if (unit.ends_with('b')) unit.resize(unit.size() - (binary ? 2 : 1));
  constexpr std::string_view kUnits = "kmgt";
  const size_t power = unit.empty() ? 0 : kUnits.find(unit) + 1;
  if (unit.size() > 1 || (power == 0 && !unit.empty())) return bad;
  const double bytes = number * std::pow(binary ? 1024.0 : 1000.0, static_cast<double>(power));
  if (!(bytes >= static_cast<double>(kLeastMemory))) {
    return Error{ErrorCode::kBadArgument,
                 Cat(Printable(text), " is less than the ", HumanBytes(kLeastMemory), " that work needs at least")};
  }
  if (!(bytes < 1e18)) return bad;
  return static_cast<uint64_t>(bytes);
}

namespace {

uint64_t TemporaryBytes(const OutputPlan& plan, const SizeFlags& flags) {
  return plan.needed > flags.arrays() ? plan.needed - flags.arrays() : 0;
}

// What one will be, as a sentence.
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

Status SayAndAsk(std::span<const OutputPlan> plans, const SizeFlags& flags, const SharedFlags& shared) {
  if (plans.empty()) return {};
  // Results add up, temporary files go before the next begins. All lie in one folder.
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
                                              ": nothing was done. --yes does it all the same; --max-gaussians N "
                                              "makes it smaller")};
  }
  for (const OutputPlan& plan : plans) {
    const bool worth_a_word = plan.bytes >= kWorthAWord || plan.seconds.value_or(0) >= kLongWait;
    if (!why.empty() || worth_a_word) LogInfo(Spoken(plan, flags));
  }
  if (why.empty() || flags.yes) return {};
  std::cerr << why << ". Go on? [y/N] " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  if (IsYes(answer)) return {};
  return Error{ErrorCode::kBadArgument, Cat(plans.front().output.string(), ": not written, as nobody said yes")};
}

}  // namespace anchorsplat

#include "cli/edit_steps_report.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "cli/clean_output.h"
#include "core/text.h"
#include "formats/axes.h"

namespace anchorsplat {

namespace {

// "LUF: x left, y up, z forward".
std::string DescribeAxes(const std::string& name) {
  constexpr std::array<std::string_view, 3> kTo = {"right", "down", "forward"}, kFrom = {"left", "up", "backward"};
  const Axes axes = AxesFromName(name).value_or(kRdf);
  std::string text = name;
  for (size_t k = 0; k < 3; ++k) {
    text += Cat(k == 0 ? ": " : ", ", "xyz"[k], " ", (axes.sign[k] > 0 ? kTo : kFrom)[axes.along[k]]);
  }
  return text;
}

}  // namespace

void PrintSteps(const std::vector<EditStep>& steps, std::ostream& out) {
  const auto directed = std::ranges::find_if(steps, [](const EditStep& step) { return !step.axes.empty(); });
  if (directed != steps.end()) out << "  axes of edits: " << DescribeAxes(directed->axes) << '\n';
  for (const EditStep& step : steps) {
    if (!step.chooses) continue;
    out << "  " << OneLine(step.action) << (step.input.empty() ? "" : Cat(" on ", OneLine(step.input))) << ": "
        << WithThousands(step.taken) << " Gaussians removed, " << WithThousands(step.left) << " left\n";
  }
}

}  // namespace anchorsplat

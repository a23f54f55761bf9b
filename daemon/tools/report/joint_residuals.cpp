#include <algorithm>

#include "daemon/tools/report/bars.hpp"
#include "daemon/tools/report/style_sections.hpp"

namespace posed::report {

Figure joint_residuals(const std::string& what, const std::vector<JointResidual>& joints) {
  std::vector<JointResidual> sorted = joints;
  std::ranges::stable_sort(sorted, std::ranges::greater{}, &JointResidual::before_deg);
  Bars bars{.quantity = "distance from the target's mean cycle, rms over the stride",
            .unit = "deg",
            .series = {"before", "after styling"},
            .groups = {}};
  for (const JointResidual& joint : sorted) {
    bars.groups.push_back({joint.joint, {joint.before_deg, joint.after_deg}});
  }
  return {.title = "What is left, joint by joint: " + what,
          .sentence =
              "Joints that the style changes most stand on top; a short second bar says "
              "that styling brings the joint to the target, one as long as the first that "
              "it does not.",
          .drawings = {draw_bars(bars)},
          .tables = {}};
}

}  // namespace posed::report

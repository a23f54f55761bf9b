// The figures of a report on styles, each made of plain numbers (figures 2, 3 and 7 of Sato et al.;
// models/style/README.md, "References"). Cold.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/tools/picture/strip.hpp"
#include "daemon/tools/report/page.hpp"
#include "daemon/tools/report/plot.hpp"

namespace posed::report {

// Figure 2: where people and styles lie.
struct StyleMark {
  std::string name, group;  // who, in which style
  double x = 0.0, y = 0.0;
};
struct StyleMap {
  std::string what;     // "style points xi of walk"
  std::string of_axis;  // what is counted along both axes, "xi"
  std::string unit;
  double first_share = 0.0, second_share = 0.0;  // of all variance, 0 to 1
  std::vector<StyleMark> marks;
  std::string explanation;  // a sentence more about what was done
};
[[nodiscard]] Figure style_map(const StyleMap& map);

// Figure 3: rows of poses at the same phases.
struct CycleRows {
  std::string title, sentence;
  struct Seen {
    picture::Camera camera;
    std::string from;  // "from the front"
  };
  std::vector<Seen> views;
  std::vector<picture::StripRow> rows;
};
[[nodiscard]] Figure cycle_strips(const CycleRows& cycles);

// Figure 7: paths of a cycle's poses in the plane of the input's two largest variances.
struct PosePaths {
  std::string what;
  struct Path {
    std::string name;
    std::vector<Point> points;  // [phase], deg; a closed path
  };
  Path input, output;
  std::optional<Path> goal;
  double first_share = 0.0, second_share = 0.0;  // of the input's variance
};
[[nodiscard]] Figure pose_paths(const PosePaths& paths);

// How the kernel was chosen, and how held-out walkers did.
struct TriedLength {
  double length_deg = 0.0, noise = 0.0;
  double error_deg = 0.0;  // of a held-out frame: rms over joints
};
[[nodiscard]] Figure kernel_choice(const std::vector<TriedLength>& tried, double chosen_deg,
                                   double chosen_noise);
struct HeldOutWalker {
  std::string clip, person;
  int left_out = 0;                            // takes that were not learnt from
  double closes = 0.0, constant_closes = 0.0;  // share of the way to the target
};
[[nodiscard]] Figure held_out_walkers(const std::vector<HeldOutWalker>& walkers);

// What is left of the distance, joint by joint.
struct JointResidual {
  std::string joint;
  double before_deg = 0.0, after_deg = 0.0;
};
[[nodiscard]] Figure joint_residuals(const std::string& what,
                                     const std::vector<JointResidual>& joints);

// How well each clip strides.
struct ClipStride {
  std::string clip, group;
  double score = 0.0;
  double period_s = 0.0;
  double residual_deg = 0.0;  // of its frames from its own mean cycle
  int frames = 0;
};
[[nodiscard]] Figure stride_scores(const std::vector<ClipStride>& clips, double warn,
                                   double refuse);

}  // namespace posed::report

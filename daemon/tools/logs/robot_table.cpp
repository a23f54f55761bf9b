#include "daemon/tools/logs/robot_table.hpp"

#include <spdlog/fmt/fmt.h>
#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"

namespace posed::tools {
namespace {

std::string does(const robot::RobotHand& hand, const robot::RobotJoint& joint) {
  if (joint.driven < 0) return fmt::format("stands at {:.1f} deg", joint.offset / kDegree);
  if (!joint.follows) return "driven";
  const robot::RobotJoint& leader = hand.joints[hand.driven[joint.driven].joint];
  return fmt::format("{:g} x {} {:+.1f} deg", joint.multiplier, leader.name,
                     joint.offset / kDegree);
}

std::string limits_of(const robot::RobotHand& hand, const robot::RobotJoint& joint) {
  const robot::Link& link = hand.links[joint.link];
  std::string text = fmt::format("{:.1f} to {:.1f} deg", joint.low / kDegree, joint.high / kDegree);
  if (link.endless) text += " (continuous)";
  if (joint.driven < 0 || joint.follows) return text;
  const robot::DrivenJoint& driven = hand.driven[joint.driven];
  constexpr double kShown_rad = 0.05 * kDegree;
  if (driven.low > joint.low + kShown_rad || driven.high < joint.high - kShown_rad) {
    text += fmt::format(", followers leave {:.1f} to {:.1f}", driven.low / kDegree,
                        driven.high / kDegree);
  }
  return text;
}

std::string speed_of(const robot::RobotHand& hand, const robot::RobotJoint& joint) {
  const double urdf = hand.links[joint.link].speed;
  const char* const from = joint.speed_given ? "config" : joint.speed == urdf ? "URDF" : "default";
  return fmt::format("{:.2f} rad/s ({})", joint.speed, from);
}

std::string direction(const Eigen::Vector3d& v) {
  // Rounded first: -0.001 would be shown as -0.00.
  const auto shown = [&v](int k) { return std::round(100.0 * v[k]) / 100.0 + 0.0; };
  return fmt::format("({:g} {:g} {:g})", shown(0), shown(1), shown(2));
}

}  // namespace

std::vector<std::string> robot_table(const robot::RobotHand& hand) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("robot {}: a {} hand, {} links, {} joints that turn, {} driven",
                              hand.name, hand.side == Side::kLeft ? "left" : "right",
                              hand.links.size(), hand.joints.size(), hand.size()));
  lines.emplace_back("joints, in the order of the stream's values");
  for (const robot::RobotJoint& joint : hand.joints) {
    lines.push_back(fmt::format("  {:<24} {:<26} {:<20} {}", joint.name, limits_of(hand, joint),
                                speed_of(hand, joint), does(hand, joint)));
  }
  lines.emplace_back("fingers");
  for (const robot::Finger& finger : hand.fingers) {
    lines.push_back(fmt::format(
        "  {:<24} from joint {} to link {}, {:.0f} mm, tip of radius {:.0f} mm{}",
        kFingerNames[static_cast<std::size_t>(finger.human)], hand.links[finger.knuckle].joint,
        hand.links[finger.tip].name, 1e3 * finger.length_m, 1e3 * finger.tip_radius_m,
        finger.tip_shaped ? "" : " (guessed: it has no shape)"));
  }
  lines.push_back(fmt::format("palm: {} out of it, {} to the thumb, {} to the fingers",
                              direction(hand.palm.col(0)), direction(hand.palm.col(1)),
                              direction(hand.palm.col(2))));
  std::string without;
  for (std::size_t l = 0; l < hand.links.size(); ++l) {
    const robot::Link& link = hand.links[l];
    if (link.missing_shapes > 0) {
      without += fmt::format(
          ", {} ({} of {} meshes are not used: missing beside the URDF, no .obj, or larger than 1 "
          "m)",
          link.name, link.missing_shapes, link.missing_shapes + std::ssize(link.shapes));
    }
  }
  lines.push_back(fmt::format(
      "shapes: {} capsules hold those of the links, {} pairs of links are kept apart, "
      "{} of them by the hulls of shapes",
      hand.capsules.size(), hand.pairs.size(),
      std::ranges::count_if(hand.pairs, [](const auto& pair) { return pair.count > 0; })));
  if (!without.empty()) lines.push_back("  without a shape: " + without.substr(2));
  std::string out;
  for (const auto& [a, b] : hand.left_out) {
    out += fmt::format(", {} and {}", hand.links[a].name, hand.links[b].name);
  }
  if (!out.empty())
    lines.push_back("  kept apart in part or not at all, because their shapes touch at rest: " +
                    out.substr(2));
  return lines;
}

}  // namespace posed::tools

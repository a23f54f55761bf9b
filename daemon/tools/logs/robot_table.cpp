#include "daemon/tools/logs/robot_table.hpp"

#include <spdlog/fmt/fmt.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

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
  if (!(joint.speed > 0.0)) return "no speed";
  const char* const from = joint.speed == urdf ? "URDF" : "default";
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
  if (!hand.chosen.empty()) {
    lines.push_back(hand.chosen +
                    "; `side` of [stream.robot], or the links that `tips` names, choose another");
  }
  if (hand.either_side) {
    lines.emplace_back("its thumb is in the middle of its fingers: left and right hands drive it");
  }
  lines.insert(lines.end(), hand.remarks.begin(), hand.remarks.end());
  lines.emplace_back("joints, in the order of the stream's values");
  for (const robot::RobotJoint& joint : hand.joints) {
    lines.push_back(fmt::format("  {:<24} {:<26} {:<20} {}", joint.name, limits_of(hand, joint),
                                speed_of(hand, joint), does(hand, joint)));
  }
  lines.emplace_back("fingers");
  for (const robot::Finger& finger : hand.fingers) {
    const bool beyond = !finger.tip_m.isZero(0.0);
    lines.push_back(fmt::format(
        "  {:<24} from joint {} to {}link {}, {:.0f} mm, tip of radius {:.0f} mm{}{}",
        kFingerNames[static_cast<std::size_t>(finger.human)], hand.links[finger.knuckle].joint,
        beyond ? "the end of " : "", hand.links[finger.tip].name, 1e3 * finger.length_m,
        1e3 * finger.tip_radius_m, finger.tip_shaped ? "" : " (guessed: it has no shape)",
        finger.tip_known ? ""
                         : "; its last link has neither shape nor tip: add a link at its end"));
  }
  lines.push_back(fmt::format("palm: {} out of it, {} to the thumb, {} to the fingers",
                              direction(hand.palm.col(0)), direction(hand.palm.col(1)),
                              direction(hand.palm.col(2))));
  lines.push_back(fmt::format(
      "shapes: {} capsules hold {} of the links, {} pairs of links are kept apart, "
      "{} of them by the hulls of shapes",
      hand.capsules.size(), hand.by_visuals ? "the visuals (there is no collision shape)" : "those",
      hand.pairs.size(),
      std::ranges::count_if(hand.pairs, [](const auto& pair) { return pair.count > 0; })));
  std::map<std::string, std::string> unused;  // by reason: links
  for (const robot::Link& link : hand.links) {
    for (const std::string& why : std::set(link.unused_meshes.begin(), link.unused_meshes.end())) {
      unused[why] += ", " + link.name;
    }
  }
  for (const auto& [why, links] : unused) {
    lines.push_back(fmt::format("  meshes of {} are not used: {}", links.substr(2), why));
  }
  const auto slow =
      std::ranges::count_if(hand.joints, [](const auto& j) { return j.speed <= 0.0; });
  if (slow > 0) {
    lines.push_back(fmt::format(
        "speeds: the URDF names none for {} joints: set speed in [stream.robot]", slow));
  }
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

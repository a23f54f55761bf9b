#include "models/feet/foot_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "models/feet/legs.hpp"
#include "proto/frame/median.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::feet {
namespace {

constexpr double kStill_m_s = 0.1;

Eigen::Vector3d root_of(const Frame& frame) {
  return Eigen::Vector3f(frame.root_position_m.data()).cast<double>();
}

// The points of one frame in the world.
struct FootPoints {
  FootPoints(const Legs& legs, const Frame& frame) {
    legs.pose(frame, pose);
    root_m = root_of(frame);
    for (std::size_t leg = 0; leg < kLegs; ++leg) {
      for (std::size_t p = 0; p < kPoints; ++p) {
        known[leg][p] = pose.measured[leg] && legs.leg(leg).has(p);
        if (known[leg][p]) pose.point_from_root_m[leg][p] += root_m;
      }
    }
  }
  [[nodiscard]] const Eigen::Vector3d& at_m(std::size_t leg, std::size_t point) const {
    return pose.point_from_root_m[leg][point];
  }
  // The ankle from its hip, in the pelvis' own axes.
  [[nodiscard]] Eigen::Vector3d from_pelvis_m(const Legs& legs, const Skeleton& skeleton,
                                              std::size_t leg) const {
    const auto thigh = static_cast<std::size_t>(legs.leg(leg).thigh);
    const auto pelvis = static_cast<std::size_t>(std::max(0, skeleton.joints[thigh].parent));
    return pose.world_rotation[pelvis].conjugate() *
           (at_m(leg, kAnkle) - root_m - pose.from_root_m[thigh]);
  }
  LegPose pose;
  Eigen::Vector3d root_m;
  OfPoints<bool> known{};  // points of a leg that is not measured are none
};

double over_ground_m(const Eigen::Vector3d& step_m) { return std::hypot(step_m.x(), step_m.z()); }

}  // namespace

std::optional<double> slide_m_s(const motion::Motion& source, const motion::Motion& moved) {
  const auto legs = Legs::find(*source.skeleton);
  const int frames = std::min(source.size(), moved.size());
  if (!legs || frames < 2) return std::nullopt;
  double sum_m_s = 0.0;
  int count = 0;
  FootPoints source_before(*legs, source.frames[0]);
  FootPoints moved_before(*legs, moved.frames[0]);
  for (int t = 1; t < frames; ++t) {
    const FootPoints source_now(*legs, source.frames[t]);
    const FootPoints moved_now(*legs, moved.frames[t]);
    for (std::size_t leg = 0; leg < kLegs; ++leg) {
      for (const std::size_t p : {kAnkle, kToe}) {
        const auto knows = [&](const FootPoints& points) { return points.known[leg][p]; };
        if (!knows(source_now) || !knows(source_before)) continue;
        if (!knows(moved_now) || !knows(moved_before)) continue;
        const Eigen::Vector3d step_m = source_now.at_m(leg, p) - source_before.at_m(leg, p);
        if (step_m.norm() * source.rate_hz >= kStill_m_s) continue;
        sum_m_s +=
            over_ground_m(moved_now.at_m(leg, p) - moved_before.at_m(leg, p)) * source.rate_hz;
        ++count;
      }
    }
    source_before = source_now;
    moved_before = moved_now;
  }
  if (count == 0) return std::nullopt;
  return sum_m_s / count;
}

std::optional<double> sink_m(const motion::Motion& source, const motion::Motion& moved) {
  const auto legs = Legs::find(*source.skeleton);
  if (!legs) return std::nullopt;
  const auto lowest_m = [&](const motion::Motion& motion) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Frame& frame : motion.frames) {
      const FootPoints points(*legs, frame);
      for (std::size_t leg = 0; leg < kLegs; ++leg) {
        if (points.known[leg][kToe]) lowest = std::min(lowest, points.at_m(leg, kToe).y());
      }
    }
    return lowest;
  };
  const double sunk_m = lowest_m(source) - lowest_m(moved);
  if (!std::isfinite(sunk_m)) return std::nullopt;
  return std::max(0.0, sunk_m);
}

std::optional<double> below_standing_m(const motion::Motion& motion) {
  const auto legs = Legs::find(*motion.skeleton);
  if (!legs || motion.size() < 2) return std::nullopt;
  std::vector<double> standing_m;
  double lowest_m = std::numeric_limits<double>::infinity();
  FootPoints before(*legs, motion.frames[0]);
  for (const Frame& frame : motion.frames) {
    const FootPoints now(*legs, frame);
    for (std::size_t leg = 0; leg < kLegs; ++leg) {
      if (!now.known[leg][kToe]) continue;
      const Eigen::Vector3d& toe_m = now.at_m(leg, kToe);
      lowest_m = std::min(lowest_m, toe_m.y());
      if (&frame == motion.frames.data() || !before.known[leg][kToe]) continue;
      const double speed_m_s = (toe_m - before.at_m(leg, kToe)).norm() * motion.rate_hz;
      if (speed_m_s < kStill_m_s) standing_m.push_back(toe_m.y());
    }
    before = now;
  }
  if (standing_m.empty()) return std::nullopt;
  return std::max(0.0, median(standing_m) - lowest_m);
}

std::optional<FootCapture> foot_capture(const motion::Motion& motion) {
  constexpr double kMin_s = 2.0, kPart_s = 0.5, kTenth = 0.1;
  const auto legs = Legs::find(*motion.skeleton);
  const int part = static_cast<int>(kPart_s * motion.rate_hz);
  if (!legs || part < 1 || motion.size() < kMin_s * motion.rate_hz) return std::nullopt;
  FootCapture capture;
  std::vector<double> slower_m_s, lowest_m;
  std::array<Eigen::Matrix3Xd, kLegs> from_pelvis_m;
  for (auto& places_m : from_pelvis_m) places_m.resize(3, motion.size());
  std::optional<FootPoints> before;
  for (int t = 0; t < motion.size(); ++t) {
    const FootPoints now(*legs, motion.frames[t]);
    if (!now.known[0][kAnkle] || !now.known[1][kAnkle]) return std::nullopt;
    double slower = std::numeric_limits<double>::infinity();
    for (std::size_t leg = 0; leg < kLegs; ++leg) {
      const Eigen::Vector3d& at_m = now.at_m(leg, kAnkle);
      from_pelvis_m[leg].col(t) = now.from_pelvis_m(*legs, *motion.skeleton, leg);
      if (before) slower = std::min(slower, over_ground_m(at_m - before->at_m(leg, kAnkle)));
    }
    if (before) slower_m_s.push_back(slower * motion.rate_hz);
    const double lower_m = std::min(now.at_m(0, kAnkle).y(), now.at_m(1, kAnkle).y());
    if (t % part == 0) {
      lowest_m.push_back(lower_m);
    } else {
      lowest_m.back() = std::min(lowest_m.back(), lower_m);
    }
    before = now;
  }
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    const Eigen::Matrix3Xd& places_m = from_pelvis_m[leg];
    const Eigen::Vector3d mean_m = places_m.rowwise().mean();
    capture.swing_m[leg] = std::sqrt((places_m.colwise() - mean_m).squaredNorm() / motion.size());
  }
  capture.slower_m_s = median(slower_m_s);
  std::ranges::sort(lowest_m);
  const auto tenth = static_cast<std::size_t>(kTenth * static_cast<double>(lowest_m.size()));
  capture.uneven_m = lowest_m[lowest_m.size() - 1 - tenth] - lowest_m[tenth];
  return capture;
}

double root_speed_m_s(const motion::Motion& motion, double period_s) {
  const int apart = std::max(1, static_cast<int>(std::lround(period_s * motion.rate_hz)));
  std::vector<double> far_m;
  for (int t = apart; t < motion.size(); ++t) {
    far_m.push_back(over_ground_m(root_of(motion.frames[t]) - root_of(motion.frames[t - apart])));
  }
  if (far_m.empty()) return 0.0;
  return median(far_m) * motion.rate_hz / apart;
}

}  // namespace posed::feet

// The synthetic hand of the look-ahead figures (models/trajectory/README.md, "Look-ahead"): 100
// gestures of g, c, p at 30 Hz, minimum-jerk moves that the fingers begin apart, slow drift and
// sensor noise on all 45 angles.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <random>
#include <string>

#include "models/gesture/recording.hpp"

namespace posed::test {

using Normal = std::normal_distribution<double>;

inline Eigen::RowVectorXd study_pose_deg(char label, const std::array<double, kFingers>& jitter) {
  static const std::map<char, std::array<int, kFingers>> open{
      {'g', {0, 0, 0, 0, 0}}, {'c', {0, 1, 1, 0, 0}}, {'p', {1, 1, 1, 1, 1}}};
  Eigen::RowVectorXd pose = Eigen::RowVectorXd::Zero(kHandChannels);
  for (int f = 0; f < kFingers; ++f) {
    const bool straight = open.at(label)[f] != 0;
    const std::array<double, 3> flexion = straight ? std::array{8.0, 6.0, 4.0}
                                          : f != 0 ? std::array{68.0, 88.0, 58.0}
                                                   : std::array{32.0, 45.0, 50.0};
    constexpr std::array<double, 3> kGive{5.0, 5.0, 3.0};
    for (int j = 0; j < kFingerJoints; ++j) {
      pose[f * kFingerChannels + 3 * j] = flexion[j] + jitter[f] * kGive[j];
    }
    pose[f * kFingerChannels + 1] = (f - 2) * (straight ? 6.0 : 1.5) + jitter[f] * 1.5;
    pose[f * kFingerChannels + 2] = (straight ? 0.0 : 3.0) + jitter[f];
  }
  return pose;
}

inline gesture::Recording study_corpus(std::uint32_t seed, int gestures = 100) {
  std::mt19937 random(seed);
  const auto normal = [&](double mean, double sd) { return Normal(mean, sd)(random); };
  const auto jitter = [&] {
    std::array<double, kFingers> all;
    for (double& value : all) value = normal(0.0, 1.0);
    return all;
  };
  gesture::Recording recording{.file = "study", .rate_hz = 30.0, .angles_rad = {}, .segments = {}};
  std::vector<Eigen::RowVectorXd> rows;
  char label = "gcp"[random() % 3];
  Eigen::RowVectorXd pose = study_pose_deg(label, jitter());
  Eigen::RowVectorXd drift = Eigen::RowVectorXd::Zero(kHandChannels);
  for (int k = 0; k < gestures; ++k) {
    const Eigen::RowVectorXd from = pose;
    const Eigen::RowVectorXd goal = study_pose_deg(label, jitter());
    const int frames = static_cast<int>(std::clamp(normal(62.0, 9.0), 38.0, 95.0));
    const double move = std::uniform_real_distribution<double>(14.0, 22.0)(random);
    std::array<double, kFingers> lag;
    for (double& value : lag) value = normal(4.0, 2.0);
    const auto begin = static_cast<int>(rows.size());
    for (int t = 0; t < frames; ++t) {
      for (int c = 0; c < kHandChannels; ++c) {
        const double s = std::clamp((t - lag[c / kFingerChannels]) / move, 0.0, 1.0);
        pose[c] = from[c] + s * s * s * (10.0 - 15.0 * s + 6.0 * s * s) * (goal[c] - from[c]);
        drift[c] = 0.97 * drift[c] + normal(0.0, 0.25);
      }
      rows.emplace_back(pose + drift);
      for (double& value : rows.back()) value += normal(0.0, 0.25);
    }
    recording.segments.push_back({begin, begin + frames, std::string(1, label)});
    pose = rows.back();
    const char before = label;
    while (label == before) label = "gcp"[random() % 3];
  }
  recording.angles_rad.resize(static_cast<Eigen::Index>(rows.size()), kHandChannels);
  for (std::size_t t = 0; t < rows.size(); ++t) {
    recording.angles_rad.row(static_cast<Eigen::Index>(t)) = rows[t] * (std::numbers::pi / 180.0);
  }
  return recording;
}

}  // namespace posed::test

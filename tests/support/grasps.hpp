// Real CyberGlove grasps of GraspDB14, 60 Hz, and their reference without the glove's dead band:
// models/smooth/README.md, "Measured figures". Degrees; [frames x 19 channels].
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "proto/frame/degree.hpp"

namespace posed::test {

using Motion = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline constexpr std::size_t kGraspAngles = 23;

// The angles of one recording as in its file [rad]; the file's columns before them are date, time
// and switch.
inline std::vector<std::array<double, kGraspAngles>> read_grasp_rows(
    const std::filesystem::path& path) {
  constexpr std::size_t kBefore = 7;
  std::vector<std::array<double, kGraspAngles>> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::vector<double> row;
    for (double value = 0.0; words >> value;) row.push_back(value);
    if (row.size() < kBefore + kGraspAngles) continue;
    std::copy_n(row.begin() + kBefore, kGraspAngles, rows.emplace_back().begin());
  }
  return rows;
}

// The same as a Motion, without palm arch, wrist and one sensor that hardly moves.
inline Motion read_grasps(const std::filesystem::path& path) {
  constexpr std::size_t kSensors = 20;
  constexpr std::size_t kLeftOut = 11;
  std::vector<double> values;
  for (const auto& row : read_grasp_rows(path)) {
    for (std::size_t s = 0; s < kSensors; ++s) {
      if (s != kLeftOut) values.push_back(row[s] / kDegree);
    }
  }
  const auto frames = static_cast<Eigen::Index>(values.size() / (kSensors - 1));
  return Eigen::Map<Motion>(values.data(), frames, kSensors - 1);
}

// Replaces the stairs of the dead band by ramps from change to change; a long hold is kept and
// ramps in its last frames.
inline void without_stairs(Eigen::Ref<Eigen::VectorXd> x) {
  constexpr Eigen::Index kShort = 7;
  constexpr Eigen::Index kRamp = 4;
  struct Knot {
    Eigen::Index at;
    double value;
  };
  std::vector<Knot> knots{{0, x[0]}};
  for (Eigen::Index i = 1; i < x.size(); ++i) {
    if (x[i] == x[i - 1]) continue;
    if (i - knots.back().at > kShort) knots.push_back({i - kRamp, knots.back().value});
    knots.push_back({i, x[i]});
  }
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const Knot from = knots[k];
    const Knot to = knots[k + 1];
    for (Eigen::Index i = from.at; i < to.at; ++i) {
      x[i] = from.value + (to.value - from.value) * static_cast<double>(i - from.at) /
                              static_cast<double>(to.at - from.at);
    }
  }
  for (Eigen::Index i = knots.back().at; i < x.size(); ++i) x[i] = knots.back().value;
}

// Butterworth low-pass of the second order, forwards and backwards, the signal extended by point
// reflection (scipy's butter(2) and filtfilt).
inline Eigen::VectorXd low_pass_8hz(const Eigen::VectorXd& signal) {
  const double w = std::tan(std::numbers::pi * 8.0 / 60.0);
  const double a0 = 1.0 + std::numbers::sqrt2 * w + w * w;
  const double b0 = w * w / a0;
  const double a1 = 2.0 * (w * w - 1.0) / a0;
  const double a2 = (1.0 - std::numbers::sqrt2 * w + w * w) / a0;
  const Eigen::Index n = signal.size();
  const Eigen::Index pad = std::min<Eigen::Index>(30, n - 2);
  Eigen::VectorXd x(n + 2 * pad);
  x.segment(pad, n) = signal;
  x.head(pad) = 2.0 * signal[0] - signal.segment(1, pad).reverse().array();
  x.tail(pad) = 2.0 * signal[n - 1] - signal.segment(n - 1 - pad, pad).reverse().array();
  for (int pass = 0; pass < 2; ++pass) {
    double z1 = (1.0 - b0) * x[0];
    double z2 = (b0 - a2) * x[0];
    for (double& value : x) {
      const double y = b0 * value + z1;
      z1 = 2.0 * b0 * value - a1 * y + z2;
      z2 = b0 * value - a2 * y;
      value = y;
    }
    x.reverseInPlace();
  }
  return x.segment(pad, n);
}

// The recording without the glove's dead band, low-passed (models/smooth/README.md, "Measured
// figures").
inline Motion grasp_reference(const std::filesystem::path& path) {
  Motion motion = read_grasps(path);
  for (Eigen::Index c = 0; c < motion.cols(); ++c) {
    Eigen::VectorXd channel = motion.col(c);
    without_stairs(channel);
    motion.col(c) = low_pass_8hz(channel);
  }
  return motion;
}

// Adds white noise of standard deviation `sd` to every value.
inline Motion noisy(const Motion& truth, double sd, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, sd);
  Motion measured = truth;
  for (double& value : measured.reshaped()) value += normal(random);
  return measured;
}

}  // namespace posed::test

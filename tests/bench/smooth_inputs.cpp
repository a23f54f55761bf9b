#include "tests/bench/smooth_inputs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include "tests/support/smoothed.hpp"

namespace posed::bench {
namespace {

namespace fs = std::filesystem;
using test::Motion;

constexpr Eigen::Index kMostFrames = 2000;  // of one recording

struct Moving {
  std::string name;
  double rate_hz;
  std::vector<Motion> motions;
};

Motion moving_channels(const Motion& motion) {
  constexpr double kMoves_deg = 3.0;
  std::vector<Eigen::Index> moving;
  for (Eigen::Index c = 0; c < motion.cols(); ++c) {
    if (motion.col(c).maxCoeff() - motion.col(c).minCoeff() > kMoves_deg) moving.push_back(c);
  }
  return motion(Eigen::all, moving);
}

// The numbers of a line, whatever stands between them.
std::vector<double> numbers_of(std::string line) {
  std::ranges::replace(line, ',', ' ');
  std::istringstream words(line);
  std::vector<double> row;
  for (double value = 0.0; words >> value;) row.push_back(value);
  return row;
}

// A VMG30's bend sensors; 1000 units are taken as 90 degrees. The low-pass removes the sensors' own
// noise, a share of a degree.
Motion vmg30(const fs::path& path) {
  constexpr std::size_t kFirst = 2;
  constexpr std::size_t kSensors = 23;
  std::vector<double> values;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const std::vector<double> row = numbers_of(line);
    if (row.size() < kFirst + kSensors) continue;
    for (std::size_t s = 0; s < kSensors; ++s) values.push_back(0.09 * row[kFirst + s]);
  }
  Motion motion = Eigen::Map<Motion>(values.data(), std::ssize(values) / 23, 23);
  for (Eigen::Index c = 0; c < motion.cols(); ++c) {
    motion.col(c) = test::low_pass_8hz(motion.col(c));
  }
  return moving_channels(motion);
}

// Every `step`-th frame.
Motion thinned(const Motion& motion, double step) {
  Motion thin(static_cast<Eigen::Index>(static_cast<double>(motion.rows() - 1) / step) + 1,
              motion.cols());
  for (Eigen::Index t = 0; t < thin.rows(); ++t) {
    const double at = step * static_cast<double>(t);
    const auto before = std::min(static_cast<Eigen::Index>(at), motion.rows() - 2);
    const double part = at - static_cast<double>(before);
    thin.row(t) = (1.0 - part) * motion.row(before) + part * motion.row(before + 1);
  }
  return thin;
}

// A hand that a simulator drives towards the motion: joints with a spring (4 Hz) and friction
// (damping 0.7), whose targets come every 100 ms.
Motion simulated(const Motion& motion, double rate_hz) {
  constexpr double kSpring = 2.0 * std::numbers::pi * 4.0;  // rad/s
  constexpr int kSteps = 20;                                // of the integration, for each frame
  const auto hold = static_cast<Eigen::Index>(0.1 * rate_hz);
  Motion made = motion;
  Eigen::RowVectorXd x = motion.row(0);
  Eigen::RowVectorXd v = Eigen::RowVectorXd::Zero(motion.cols());
  const double dt_s = 1.0 / (rate_hz * kSteps);
  for (Eigen::Index t = 0; t < motion.rows(); ++t) {
    const Eigen::RowVectorXd target = motion.row(t / hold * hold);
    for (int i = 0; i < kSteps; ++i) {
      v += dt_s * (kSpring * kSpring * (target - x) - 1.4 * kSpring * v);
      x += dt_s * v;
    }
    made.row(t) = x;
  }
  return made;
}

// Signs one after another: minimum-jerk moves of 0.3 to 0.6 s, holds of 0.5 to 1.5 s.
Motion signs(const fs::path& folder, const std::vector<std::string>& letters, unsigned seed) {
  constexpr std::size_t kSensors = 22;
  std::mt19937_64 random(seed);
  const auto between = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11U) * 0x1p-53;
  };
  const auto pose = [&](const std::string& letter) {
    std::ifstream file(folder / (letter + ".csv"));
    std::vector<Eigen::RowVectorXd> rows;
    for (std::string line; std::getline(file, line, '\r');) {
      std::vector<double> row = numbers_of(line);
      if (row.size() < kSensors) continue;
      rows.emplace_back(Eigen::Map<Eigen::RowVectorXd>(row.data(), kSensors) / kDegree);
    }
    return rows[random() % rows.size()];
  };
  Motion motion(1800, kSensors);
  Eigen::RowVectorXd from = pose(letters[0]);
  for (Eigen::Index t = 0, i = 1; t < motion.rows(); ++i) {
    const Eigen::RowVectorXd to = pose(letters[static_cast<std::size_t>(i) % letters.size()]);
    const double move = 60.0 * between(0.3, 0.6);
    const double all = move + 60.0 * between(0.5, 1.5);
    for (int k = 0; k < all && t < motion.rows(); ++k, ++t) {
      const double way = std::min(1.0, k / move);
      motion.row(t) =
          from + (to - from) * (way * way * way * (10.0 - 15.0 * way + 6.0 * way * way));
    }
    from = to;
  }
  return motion;
}

// Four channels, a quarter of a turn apart.
Motion sine(double frequency_hz, double rate_hz = 60.0) {
  Motion motion(1800, 4);
  for (Eigen::Index t = 0; t < motion.rows(); ++t) {
    for (Eigen::Index c = 0; c < 4; ++c) {
      const double turns =
          frequency_hz * static_cast<double>(t) / rate_hz + 0.25 * static_cast<double>(c);
      motion(t, c) = 30.0 * std::sin(2.0 * std::numbers::pi * turns);
    }
  }
  return motion;
}

Motion ramp(double deg_s) {
  Motion motion(1800, 4);
  for (Eigen::Index t = 0; t < motion.rows(); ++t) {
    const double way = std::fmod(deg_s * static_cast<double>(t) / 60.0, 120.0);
    motion.row(t).setConstant(way < 60.0 ? way : 120.0 - way);
  }
  return motion;
}

// White noise for `correlation` 0, else of the first order; `sd` of both.
void add_noise(Motion& motion, double sd, double correlation, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double fresh = std::sqrt(1.0 - correlation * correlation);
  for (Eigen::Index c = 0; c < motion.cols(); ++c) {
    double now = normal(random);
    for (double& value : motion.col(c)) {
      value += sd * now;
      now = correlation * now + fresh * normal(random);
    }
  }
}

struct Noise {
  const char* name;
  double sd = 0.0, correlation = 0.0;  // deg
  double step = 0.0;                   // deg
  int repeats = 1;                     // frames that show one sample
  bool alone = false;                  // the channels are sampled in turns
};
constexpr std::array kNoises{Noise{"white 1", 1.0},
                             Noise{"white 3", 3.0},
                             Noise{"AR(.8) 1", 1.0, 0.8},
                             Noise{"AR(.8) 3", 3.0, 0.8},
                             Noise{.name = "step 1", .step = 1.0},
                             Noise{.name = "step 2", .step = 2.0},
                             Noise{.name = "step 3", .step = 3.0},
                             Noise{.name = "white 1 x2", .sd = 1.0, .repeats = 2},
                             Noise{.name = "white 1 x3", .sd = 1.0, .repeats = 3},
                             Noise{.name = "alone 1 x2", .sd = 1.0, .repeats = 2, .alone = true}};

Trial measured(const Motion& truth, double rate_hz, const Noise& noise, unsigned seed) {
  std::mt19937_64 random(seed);
  Motion shown = truth;
  add_noise(shown, noise.sd, noise.correlation, random);
  for (Eigen::Index t = 1; t < shown.rows(); ++t) {
    for (Eigen::Index c = 0; c < shown.cols(); ++c) {
      const Eigen::Index turn = noise.alone ? t + c : t;
      if (turn % noise.repeats != 0) shown(t, c) = shown(t - 1, c);
    }
  }
  if (noise.step > 0.0) {
    shown = ((shown.array() / noise.step).round() * noise.step).matrix().eval();
  }
  return {.truth = truth, .measured = shown, .rate_hz = rate_hz};
}

std::vector<Moving> hands(const fs::path& gloves, Half half) {
  const bool judge = half == Half::kJudge;
  std::vector<Moving> hands;
  const fs::path grasps = gloves / "graspdb14_cyberglove";
  if (fs::exists(grasps)) {
    Moving& hand = hands.emplace_back("grasps, 60 Hz", 60.0);
    if (judge) {
      for (const char* name : {"10_ex01-rad-003-grasp-su04.txt", "01_ex01-rad-002-grasp-su01.txt",
                               "04_ex01-rad-045-grasp-su03.txt"}) {
        hand.motions.push_back(test::grasp_reference(grasps / name));
      }
    } else {
      hand.name = "calibration, 60 Hz";
      hand.motions.push_back(
          test::grasp_reference(grasps / "00_calib-rad-su01.txt").topRows(kMostFrames));
    }
    Moving simulator{"simulator, 60 Hz", 60.0, {}};
    for (const Motion& motion : hand.motions) {
      simulator.motions.push_back(simulated(motion, 60.0));
    }
    hands.push_back(std::move(simulator));
  }
  const fs::path vmg = gloves / "vmg30_grasps";
  if (fs::exists(vmg)) {
    Moving full{"VMG30, 100 Hz", 100.0, {}};
    Moving camera{"camera, 30 Hz", 30.0, {}};
    for (const char* object : {"bottle_", "glasses_", "pen_"}) {
      for (const char* number : {judge ? "01" : "02", judge ? "03" : "04", judge ? "05" : "06"}) {
        full.motions.push_back(vmg30(vmg / (std::string(object) + number + ".txt")));
        camera.motions.push_back(thinned(full.motions.back(), 100.0 / 30.0));
      }
    }
    hands.push_back(std::move(full));
    hands.push_back(std::move(camera));
  }
  const fs::path libras = gloves / "libras_cyberglove";
  if (fs::exists(libras)) {
    const std::vector<std::string> letters =
        judge ? std::vector<std::string>{"A", "V", "4", "G", "W", "B"}
              : std::vector<std::string>{"C", "L", "5", "I", "R", "F"};
    hands.push_back({"signs, 60 Hz", 60.0, {signs(libras, letters, judge ? 1 : 2)}});
  }
  return hands;
}

}  // namespace

std::vector<SmoothInput> smooth_inputs(const fs::path& gloves, Half half) {
  const bool judge = half == Half::kJudge;
  const unsigned seed = judge ? 11 : 12;
  std::vector<SmoothInput> inputs;
  const auto add = [&](const Moving& moving, const Noise& noise) {
    SmoothInput& input = inputs.emplace_back(moving.name, noise.name);
    input.noise_deg = noise.step > 0.0 ? noise.step / std::sqrt(12.0) : noise.sd;
    for (std::size_t i = 0; i < moving.motions.size(); ++i) {
      input.trials.push_back(measured(moving.motions[i], moving.rate_hz, noise,
                                      seed + 100 * static_cast<unsigned>(i)));
    }
  };
  for (const Moving& hand : hands(gloves, half)) {
    for (const Noise& noise : kNoises) add(hand, noise);
  }
  const auto names = [](const char* what, double number) {
    std::ostringstream text;
    text << what << ' ' << number;
    return text.str();
  };
  for (const double hz : judge ? std::vector{0.5, 1.0, 2.0, 3.0} : std::vector{0.7, 1.4, 2.6}) {
    for (const Noise& noise : {kNoises[0], kNoises[1]}) {
      add({names("sine of Hz", hz), 60.0, {sine(hz)}}, noise);
    }
  }
  for (const Noise& noise : {kNoises[0], kNoises[4], kNoises[6]}) {
    add({"drumming, 30 Hz", 30.0, {sine(judge ? 6.0 : 5.5, 30.0)}}, noise);
  }
  for (const double deg_s : judge ? std::vector{10.0, 60.0} : std::vector{5.0, 25.0}) {
    for (const Noise& noise : {kNoises[0], kNoises[1]}) {
      add({names("ramp of deg/s", deg_s), 60.0, {ramp(deg_s)}}, noise);
    }
  }
  return inputs;
}

clip::ChannelMatrix live_stage(const Trial& trial, int lag) {
  // One channel for each joint: joints of three would have two descriptions of a rotation.
  Skeleton skeleton;
  skeleton.name = "hand";
  for (Eigen::Index c = 0; c < trial.measured.cols(); ++c) {
    Joint& joint = skeleton.joints.emplace_back();
    joint.name = "joint" + std::to_string(c);
    joint.parent = static_cast<int>(c) - 1;
    skeleton.channels.push_back({.joint = static_cast<std::uint16_t>(c), .axis = Axis::kX});
  }
  skeleton.finish().value();
  smooth::LiveSmoother smoother(skeleton, test::live_options(lag, 0.0));
  test::Frames out;
  for (Eigen::Index t = 0; t < trial.measured.rows(); ++t) {
    const Frame frame =
        test::frame_of(skeleton, trial.measured.row(t), static_cast<std::uint64_t>(t + 1),
                       nanoseconds(static_cast<double>(t) / trial.rate_hz));
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  clip::ChannelMatrix made = trial.measured;
  for (std::size_t t = 0; t < out.all.size(); ++t) {
    for (Eigen::Index c = 0; c < made.cols(); ++c) {
      made(static_cast<Eigen::Index>(t), c) =
          static_cast<double>(out.all[t].angle_rad[static_cast<std::size_t>(c)]) / kDegree;
    }
  }
  return made;
}

}  // namespace posed::bench

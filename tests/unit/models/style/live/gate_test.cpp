// The gate: what counts as known, how fast and how smoothly it opens and closes.
#include "models/style/live/walker_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <catch2/catch.hpp>

#include "models/gp/isa.hpp"
#include "models/motion/leg_signal.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/live/live_motion.hpp"
#include "models/style/train/train.hpp"
#include "proto/frame/degree.hpp"
#include "tests/unit/models/style/toy_style.hpp"

using namespace posed;
using namespace posed::test;

namespace {

constexpr double kGateRate_hz = 60.0;
constexpr double kTurn_rad = 2.0 * std::numbers::pi;

// The toy names no upper legs, so that its poses alone count.
class ToyGate {
 public:
  // The pose of training, `away_rad` off in every dimension.
  float step(double away_rad, double dt_s = 1.0 / kGateRate_hz) {
    std::vector<float> q(15);
    for (std::size_t d = 0; d < q.size(); ++d) {
      q[d] = static_cast<float>(model.process.inputs(3, static_cast<Eigen::Index>(d)) + away_rad);
    }
    const std::vector<std::uint8_t> all(15, 1);
    const double away_deg = known.distance_deg(q, all);
    gate.update(&known, true, {}, q, all, {away_deg, away_deg}, {}, dt_s);
    return gate.open();
  }
  style::StyleModel model = gated_toy_model(1);
  style::TrainedMotion known{model, toy_skeleton()};
  style::Gate gate;
};

// How a walker moves: so many times as fast as in training, 0 standing still; in other poses than
// there, by so many degrees; and how much the pelvis rises as the legs come apart.
struct Walking {
  double speed = 1.0;
  double away_deg = 0.0;
  double rise_m_rad = 0.0;
};

// A gate that knows the poses of a synthetic walk and, in its legs, the stride.
class WalkingGate {
 public:
  explicit WalkingGate(double gait_correlation = -0.5)
      : clip_(motion::make_walker({.seconds = 9.0, .noise_deg = 0.0}).value()) {
    style::StyleModel model;
    model.space = motion::describe_space(motion::Space::kNative, *clip_.skeleton).value();
    const auto space = motion::PoseSpace::bind(model.space, *clip_.skeleton).value();
    const auto dims = static_cast<std::size_t>(space.dims());
    q_.resize(dims);
    available_.resize(dims);
    model.process.inputs.resize(40, space.dims());
    model.process.mu = 1.0;
    for (int i = 0; i < 40; ++i) {
      space.to_vector(clip_.frame(i), 0.0, q_, available_);
      for (std::size_t d = 0; d < dims; ++d) {
        model.process.inputs(i, static_cast<Eigen::Index>(d)) = static_cast<double>(q_[d]);
      }
    }
    model.gate = {Eigen::VectorXd::Zero(space.dims()), 0.4, stride_s(), gait_correlation};
    space_ = space;
    spec_ = model.space;
    known_.emplace(model, *clip_.skeleton);
  }

  // How far the gate is open after 5 s.
  float walk(style::Gate& gate, const Walking& how, bool on = true,
             const std::optional<style::Walker>& walker = {}) {
    for (int i = 0; i < 5 * kGateRate_hz; ++i) step(gate, i, how, on, walker);
    return gate.open();
  }
  void step(style::Gate& gate, int i, const Walking& how, bool on = true,
            const std::optional<style::Walker>& walker = {}) {
    constexpr double kStep_s = 1.0 / kGateRate_hz;
    Frame in = clip_.frame(static_cast<int>(i * kStep_s * how.speed * clip_.frame_rate_hz));
    space_->to_vector(in, 0.0, q_, available_);
    for (float& angle : q_) angle += static_cast<float>(how.away_deg * kDegree / std::sqrt(3.0));
    const double apart_rad = std::abs(known_->legs()->value_rad(in));
    in.root_position_m[1] = static_cast<float>(1.0 + how.rise_m_rad * apart_rad);
    const double away_deg = known_->distance_deg(q_, available_);
    gate.update(&*known_, on, in, q_, available_, {away_deg, away_deg}, walker, kStep_s);
  }
  [[nodiscard]] const style::TrainedMotion& known() const { return *known_; }
  // How far the parts are from training where the joint of a bone is turned by so much.
  style::TrainedMotion::PartDistances turned(Bone bone, double deg) {
    space_->to_vector(clip_.frame(0), 0.0, q_, available_);
    for (int d = 0; d < space_->dims(); ++d) {
      if (space_->skeleton_joint_of_dim(d) != clip_.skeleton->joint_of(bone)) continue;
      q_[static_cast<std::size_t>(d)] += static_cast<float>(deg * kDegree / std::sqrt(3.0));
    }
    return known_->distances_deg(q_, available_, style::loose_parts_of(*space_, spec_)).part_deg;
  }

 private:
  // From one instant at which the right leg passes the left one to the next.
  [[nodiscard]] double stride_s() const {
    const auto legs = motion::LegSignal::find(*clip_.skeleton);
    std::vector<int> passes;
    for (int i = 1; i < clip_.frames(); ++i) {
      if (legs->value_rad(clip_.frame(i - 1)) < 0.0 && legs->value_rad(clip_.frame(i)) >= 0.0) {
        passes.push_back(i);
      }
    }
    return static_cast<double>(passes.back() - passes.front()) /
           (static_cast<double>(passes.size() - 1) * clip_.frame_rate_hz);
  }

  clip::Clip clip_;
  motion::PoseSpaceSpec spec_;
  std::optional<motion::PoseSpace> space_;
  std::optional<style::TrainedMotion> known_;
  std::vector<float> q_;
  std::vector<std::uint8_t> available_;
};

}  // namespace

TEST_CASE("strides like the training's open the gate, rest and a run close it", "[style]") {
  WalkingGate walk;
  REQUIRE(walk.known().legs());
  style::Gate gate;
  CHECK(walk.walk(gate, {}) == 1.0F);
  CHECK(gate.strides());
  CHECK(walk.walk(gate, {.speed = 0.0}) == 0.0F);
  CHECK_FALSE(gate.strides());
  CHECK(walk.walk(gate, {}) == 1.0F);
  const Walking run{.speed = 1.6, .away_deg = 12.0};
  CHECK(walk.walk(gate, run) < 0.05F);
  const style::Walker quick{.cadence_rad_s = 1.6 * walk.known().cadence_rad_s()};
  CHECK(walk.walk(gate, run, true, quick) > 0.95F);
  CHECK(walk.walk(gate, {.speed = 1.6}) == 1.0F);  // the very poses of training at another pace
}

TEST_CASE("legs that stride slowly do not rest between steps", "[style]") {
  const auto least_open = [](double speed) {
    WalkingGate walk;
    style::Gate gate;
    float least = 1.0F;
    for (int i = 0; i < 8 * kGateRate_hz; ++i) {
      walk.step(gate, i, {.speed = speed});
      if (i > 2 * kGateRate_hz) least = std::min(least, gate.open());
    }
    return least;
  };
  CHECK(least_open(0.6) == 1.0F);
  CHECK(least_open(0.4) > 0.9F);
}

TEST_CASE("how the pelvis moves tells a run from a walk, at the same pace", "[style]") {
  const Walking slow_run{.speed = 1.1, .away_deg = 12.0, .rise_m_rad = 0.1};
  const Walking quick_walk{.speed = 1.35, .away_deg = 12.0, .rise_m_rad = -0.1};
  WalkingGate walk;
  style::Gate gate;
  CHECK(walk.walk(gate, slow_run) < 0.05F);
  CHECK(walk.walk(gate, quick_walk) > 0.95F);
  WalkingGate run(0.9);  // was trained on runs
  CHECK(run.walk(gate, slow_run) > 0.95F);
  WalkingGate older(std::numeric_limits<double>::quiet_NaN());  // the cadence alone counts
  CHECK(older.walk(gate, slow_run) > 0.95F);
  CHECK(older.walk(gate, quick_walk) < 0.05F);
}

TEST_CASE("a walk that freezes closes the gate half way within 0.3 s, at any phase", "[style]") {
  for (int phase = 0; phase < 60; phase += 5) {
    WalkingGate walk;
    style::Gate gate;
    for (int i = 0; i < 120 + phase; ++i) walk.step(gate, i, {});
    REQUIRE(gate.open() == 1.0F);
    const int frozen = (120 + phase) / 2;  // the frame of the clip, at half the rate
    for (int i = 0; i < static_cast<int>(0.3 * kGateRate_hz); ++i) {
      walk.step(gate, frozen * 2, {});
    }
    CHECK(gate.open() < 0.5F);
  }
}

TEST_CASE("a shoulder belongs to its arm, and counts alone, too", "[style]") {
  using style::LoosePart;
  WalkingGate walking;
  const auto bent = walking.turned(Bone::kLeftLowerArm, 60.0);
  CHECK(bent[style::index_of(LoosePart::kLeftArm)] == Approx(30.0).epsilon(0.01));
  CHECK(bent[style::index_of(LoosePart::kLeftShoulder)] < 0.1F);
  CHECK(bent[style::index_of(LoosePart::kRightArm)] < 0.1F);
  const auto raised = walking.turned(Bone::kRightShoulder, 30.0);
  CHECK(raised[style::index_of(LoosePart::kRightShoulder)] == Approx(30.0).epsilon(0.01));
  CHECK(raised[style::index_of(LoosePart::kRightArm)] == Approx(15.0).epsilon(0.01));
}

TEST_CASE("an arm that does something else leaves its shoulder the style", "[style]") {
  const auto walk = [](motion::WalkerFamily family) {
    return motion::make_walker({.family = family, .noise_deg = 0.0}).value();
  };
  const clip::Clip usual = walk(motion::WalkerFamily::kMarch);
  style::TrainOptions options;
  options.target = "tired";  // its shoulders hang
  const auto model =
      style::train_style({{usual, "march", "1", "walk"},
                          {walk(motion::WalkerFamily::kTired), "tired", "1", "walk"}},
                         options)
          .value();
  const Skeleton& skeleton = *usual.skeleton;
  const int arm = skeleton.joint_of(Bone::kRightUpperArm);
  clip::Clip raised = usual;
  for (Eigen::Index c = 0; c < raised.channels.cols(); ++c) {
    const Channel& channel = skeleton.channels[static_cast<std::size_t>(c)];
    if (channel.joint == arm && channel.axis == Axis::kZ) raised.channels.col(c).array() += 2.5;
  }
  // How far the style turns the joint of a bone, on average.
  const auto turned_deg = [&](const clip::Clip& clip, const clip::Clip& styled, Bone bone) {
    const auto joint = static_cast<std::size_t>(skeleton.joint_of(bone));
    double sum = 0.0;
    for (int i = 0; i < clip.frames(); ++i) {
      const auto before = clip.frame(i).rotation_xyzw[joint];
      const auto after = styled.frame(i).rotation_xyzw[joint];
      double same = 0.0;
      for (std::size_t k = 0; k < 4; ++k) same += static_cast<double>(before[k] * after[k]);
      sum += 2.0 * std::acos(std::min(std::abs(same), 1.0));
    }
    return sum / clip.frames() / kDegree;
  };
  const clip::Clip walks = style::apply_to_clip(model, "tired", usual, {}).value().clip;
  const clip::Clip waves = style::apply_to_clip(model, "tired", raised, {}).value().clip;
  const double whole = turned_deg(usual, walks, Bone::kRightShoulder);
  CAPTURE(whole, turned_deg(raised, waves, Bone::kRightShoulder));
  CHECK(whole > 2.0);
  CHECK(turned_deg(raised, waves, Bone::kRightShoulder) > 0.8 * whole);
  CAPTURE(turned_deg(usual, walks, Bone::kRightUpperArm),
          turned_deg(raised, waves, Bone::kRightUpperArm));
  CHECK(turned_deg(usual, walks, Bone::kRightUpperArm) > 2.0);
  CHECK(turned_deg(raised, waves, Bone::kRightUpperArm) < 0.1);
}

TEST_CASE("a gate that is off is open and still measures the cadence, for warm-ups", "[style]") {
  WalkingGate walk;
  style::Gate gate;
  CHECK(walk.walk(gate, {.speed = 1.6}, false) == 1.0F);
  CHECK(gate.legs().cadence_rad_s == Approx(1.6 * walk.known().cadence_rad_s()).epsilon(0.1));
}

TEST_CASE("the correlation of height and legs is low in a walk, high in a run", "[style]") {
  for (const double rate_hz : {30.0, 120.0}) {
    style::LiveGait walk, run, flat;
    for (int i = 0; i < 3 * rate_hz; ++i) {
      const double leg_rad = 0.5 * std::cos(kTurn_rad * i / rate_hz);
      walk.update(1.0 - 0.1 * std::abs(leg_rad), leg_rad, 1.0 / rate_hz);
      run.update(1.0 + 0.1 * std::abs(leg_rad), leg_rad, 1.0 / rate_hz);
      flat.update(1.0, leg_rad, 1.0 / rate_hz);
      if (i < 0.35 * rate_hz) CHECK(std::isnan(walk.correlation()));
      if (i < 0.45 * rate_hz) continue;
      CHECK(walk.correlation() == Approx(-1.0));
      CHECK(run.correlation() == Approx(1.0));
      CHECK(std::isnan(flat.correlation()));
    }
    walk.forget();
    CHECK(std::isnan(walk.correlation()));
  }
}

TEST_CASE("the speed of a pose is the rms over its joints, also with missing ones", "[style]") {
  const style::TrainedMotion known(gated_toy_model(1), toy_skeleton());  // 5 joints
  std::vector<float> q(15);
  std::vector<std::uint8_t> available(15, 1);
  style::PoseSpeed speed;
  for (int i = 0; i < 30; ++i) {
    speed.update(known, q, available, 0.01);
    if (i == 0) CHECK(std::isnan(speed.value_deg_s()));
    for (float& angle : q) angle += 0.01F;
  }
  const double whole_deg_s = std::sqrt(3.0) / kDegree;  // every angle by 1 rad/s
  CHECK(speed.value_deg_s() == Approx(whole_deg_s).epsilon(1e-3));
  for (int i = 0; i < 30; ++i) {  // what is missing counts as the rest does
    available[4] = 0;
    speed.update(known, q, available, 0.01);
    for (float& angle : q) angle += 0.01F;
  }
  CHECK(speed.value_deg_s() == Approx(whole_deg_s).epsilon(1e-3));
  for (int i = 0; i < 30; ++i) speed.update(known, q, available, 0.01);
  CHECK(speed.value_deg_s() < 0.1);
}

TEST_CASE("the nearest training pose is found, also with missing joints", "[style]") {
  const auto model = gated_toy_model(1);
  const style::TrainedMotion known(model, toy_skeleton());
  std::vector<float> q(15);
  std::vector<std::uint8_t> all(15, 1);
  for (std::size_t d = 0; d < 15; ++d)
    q[d] = static_cast<float>(model.process.inputs(7, static_cast<Eigen::Index>(d)));
  CHECK(known.distance_deg(q, all) == Approx(0.0).margin(1e-3));
  q[4] += 0.1F;
  CHECK(known.distance_deg(q, all) == Approx(0.1 / std::sqrt(5.0) * 180.0 / kPi).epsilon(1e-4));
  all[4] = 0;
  CHECK(known.distance_deg(q, all) == Approx(0.0).margin(1e-3));
  CHECK(std::isnan(known.distance_deg(q, std::vector<std::uint8_t>(15, 0))));
}

TEST_CASE("distances have the bits of plain sums, on every instruction set", "[style]") {
  style::StyleModel model = gated_toy_model(1);
  const Eigen::MatrixXd poses = model.process.inputs;
  model.process.inputs.resize(100, 15);  // more than a tile
  for (int i = 0; i < 100; ++i) {
    model.process.inputs.row(i) = (1.0 + 0.01 * i) * poses.row(i % poses.rows());
  }
  const style::TrainedMotion known(model, toy_skeleton());
  std::vector<float> q(15);
  std::vector<std::uint8_t> available(15, 1);
  available[4] = 0;
  std::vector<style::LoosePart> parts(15, style::LoosePart::kNone);
  for (std::size_t d = 0; d < 15; ++d) {
    q[d] = 0.2F * std::sin(3.0F * static_cast<float>(d));
    if (d > 2) parts[d] = static_cast<style::LoosePart>(d / 3 % 2 == 0 ? 0 : 2);
  }
  float whole_rad2 = std::numeric_limits<float>::infinity();
  float arm_rad2 = whole_rad2;
  for (int i = 0; i < 100; ++i) {
    float whole = 0.0F;
    float arm = 0.0F;
    for (std::size_t d = 0; d < 15; ++d) {
      if (available[d] == 0) continue;
      const auto pose = static_cast<float>(model.process.inputs(i, static_cast<Eigen::Index>(d)));
      const float square = (q[d] - pose) * (q[d] - pose);
      whole += square;
      if (parts[d] == style::LoosePart::kLeftArm) arm += square;
    }
    whole_rad2 = std::min(whole_rad2, whole);
    arm_rad2 = std::min(arm_rad2, arm);
  }
  const double whole_deg = std::sqrt(static_cast<double>(whole_rad2) * 15.0 / 14 / 5.0) / kDegree;
  const float arm_deg = std::sqrt(arm_rad2 / (5.0F / 3.0F)) / static_cast<float>(kDegree);
  for (const char* isa : {"portable", "avx2", "avx512", "auto"}) {
    if (!gp::set_isa(isa)) continue;
    const auto found = known.distances_deg(q, available, parts);
    CHECK(found.whole_deg == whole_deg);
    CHECK(found.part_deg[style::index_of(style::LoosePart::kLeftArm)] == arm_deg);
    CHECK(found.part_deg[style::index_of(style::LoosePart::kHead)] == 0.0F);
    CHECK(known.distance_deg(q, available) == whole_deg);
  }
}

TEST_CASE("the gate is exactly open on known poses and exactly closed far from them", "[style]") {
  ToyGate toy;
  for (int i = 0; i < 120; ++i) toy.step(0.0);
  CHECK(toy.gate.open() == 1.0F);
  for (int i = 0; i < 120; ++i) toy.step(1.0);
  CHECK(toy.gate.open() == 0.0F);
}

TEST_CASE("the gate is half open or closed within 0.3 s, at any rate, without a jerk", "[style]") {
  for (const double rate_hz : {25.0, 60.0, 240.0}) {
    ToyGate toy;
    CHECK(toy.step(1.0, 1.0 / rate_hz) == 0.0F);
    std::vector<double> open;
    double half_s = -1.0;
    for (int i = 0; i < 2.0 * rate_hz; ++i) {
      open.push_back(toy.step(0.0, 1.0 / rate_hz));
      if (half_s < 0.0 && open.back() >= 0.5) half_s = (i + 1) / rate_hz;
    }
    CHECK(half_s > 0.1);
    CHECK(half_s <= 0.3);
    double jerk = 0.0;  // per s^3
    for (std::size_t i = 3; i < open.size(); ++i) {
      jerk = std::max(jerk, std::abs(open[i] - 3 * open[i - 1] + 3 * open[i - 2] - open[i - 3]) *
                                std::pow(rate_hz, 3));
      CHECK(open[i] >= open[i - 1]);
    }
    CHECK(jerk < 2300.0);
  }
}

TEST_CASE("a gate that was never on is open at once, one that is switched off opens", "[style]") {
  ToyGate toy;
  style::Gate never;
  never.update(nullptr, true, {}, {}, {}, {}, {}, 0.0);
  CHECK(never.open() == 1.0F);
  for (int i = 0; i < 60; ++i) toy.step(1.0);
  toy.gate.update(nullptr, true, {}, {}, {}, {}, {}, 1.0 / kGateRate_hz);
  CHECK(toy.gate.open() < 0.1F);
  for (int i = 0; i < 120; ++i)
    toy.gate.update(nullptr, true, {}, {}, {}, {}, {}, 1.0 / kGateRate_hz);
  CHECK(toy.gate.open() == 1.0F);
}

TEST_CASE("live strides: swing and cadence of a walk, none of rest, held steps or small sways",
          "[style]") {
  const double cadence = kTurn_rad / 1.1;
  for (const double rate_hz : {30.0, 120.0}) {
    style::LiveStride walk;
    style::LiveStride held;
    double least = 10.0;
    for (int i = 0; i < 4 * rate_hz; ++i) {
      const double t = i / rate_hz;
      walk.update(0.6 * std::cos(kTurn_rad * t / 0.8), 1.0 / rate_hz, cadence);
      held.update(0.6, 1.0 / rate_hz, cadence);
      if (t > 0.5) least = std::min(least, walk.swing_rad());
    }
    CHECK(least > 0.4);
    CHECK(walk.swing_rad() < 0.9);
    CHECK(walk.cadence_rad_s() * 0.8 == Approx(kTurn_rad).epsilon(0.1));
    CHECK(held.swing_rad() == 0.0);
    walk.forget_cadence();
    CHECK(std::isnan(walk.cadence_rad_s()));
  }
}

TEST_CASE("legs do not rest where time turns round, in any phase and at any rate",
          "[style][gate]") {
  const double cadence = kTurn_rad / 1.1;
  for (const int rate_hz : {30, 60, 120}) {
    for (int eighth = 0; eighth < 8; ++eighth) {
      INFO(rate_hz << " Hz, " << eighth << " eighths");
      const auto leg_rad = [&](int frame) {
        return 0.6 * std::cos(kTurn_rad * eighth / 8.0 + cadence * frame / rate_hz);
      };
      style::LiveStride walk;
      const double dt_s = 1.0 / rate_hz;
      for (int i = 3 * rate_hz / 2; i >= 0; --i) walk.update(leg_rad(i), dt_s, cadence);
      walk.turn_back();
      double least_rad = 1.0;
      for (int i = 1; i < rate_hz; ++i) {
        walk.update(leg_rad(i), dt_s, cadence);
        least_rad = std::min(least_rad, walk.swing_rad());
      }
      CHECK(least_rad > 0.35);
    }
  }
}

// Labels performed on a live body and on one that only performs: heading, place and feet stay those
// of the body, and nothing jumps.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "models/generate/generate_stage.hpp"
#include "models/perform/standing.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/processor_time.hpp"
#include "tests/support/smoothed.hpp"
#include "tests/support/synthetic_arms.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

namespace posed::generate {
namespace {

const gesture::GestureModel& arms() {
  static const gesture::GestureModel model = test::synthetic_arms();
  return model;
}

// A figure that stands three metres from the origin, turned by a radian, with its stage.
class ArmStage {
 public:
  explicit ArmStage(double rate_hz = 30.0, Source source = Source::kDevice)
      : rate_hz_(rate_hz), source_(source) {
    auto bound = bind_model(arms(), *skeleton_, rate_hz, "arms.gesture");
    REQUIRE(bound.has_value());
    model_ = std::move(*bound);
    stage_.emplace(skeleton_, smooth::LiveOptions{.lag = {.frames = 0}}, rate_hz, model_.get());
  }

  // Sways slowly, so that it is alive.
  Frame input() {
    const double time_s = static_cast<double>(sent_) / rate_hz_;
    Frame frame = body_.frame(0);
    const auto turn = [&](Bone bone, Axis axis, double angle_rad) {
      const auto joint = skeleton_->joint_of(bone);
      const auto now = to_eigen_double(frame.rotation_xyzw[static_cast<std::size_t>(joint)]);
      set_rotation(*skeleton_, joint, Eigen::Quaterniond(axis_rotation(axis, angle_rad) * now),
                   frame);
    };
    turn(Bone::kHips, Axis::kY, 1.0);
    if (source_ == Source::kDevice) turn(Bone::kSpine, Axis::kX, 0.05 * std::sin(2.0 * time_s));
    frame.root_position_m[0] += 3.0F;
    frame.header.sequence = ++sent_;
    frame.header.device_ns = nanoseconds(time_s);
    frame.header.arrival_ns = frame.header.device_ns;
    frame.source = source_;
    if (source_ == Source::kLabels) frame.quality = Quality::kHeld;
    return frame;
  }

  void frames(int count) {
    for (int i = 0; i < count; ++i) {
      live = input();
      stage_->received(live.header.arrival_ns);
      stage_->process({.frame = live}, out);
    }
  }

  [[nodiscard]] bool play(const std::string& labels) {
    const auto order =
        gesture::make_play_order(model_->gesture(), gesture::split_labels(labels), 1.0, false);
    REQUIRE(order.has_value());
    return stage_->command(GenerateStage::kPlay, StageCommand::of(*order));
  }

  // Frames until the performance and the way back are over.
  void finish() {
    for (int i = 0; stage_->performs(); ++i) {
      frames(1);
      REQUIRE(i < 10'000);
    }
  }

  [[nodiscard]] double left_deg(const Frame& frame) const {
    return test::raised_deg(*skeleton_, frame, Bone::kLeftUpperArm);
  }
  // How far the middle of the feet is from that of the live frame [m].
  [[nodiscard]] double off_m(const Frame& frame) const {
    const perform::Standing standing(*skeleton_);
    const auto shown = standing.feet_m(frame), wanted = standing.feet_m(live);
    return ((shown[0] + shown[1]) - (wanted[0] + wanted[1])).norm() / 2.0;
  }
  // The largest angle between a joint's steps of neighbouring frames: its acceleration [deg].
  [[nodiscard]] double roughest_deg() const {
    double most = 0.0;
    for (std::size_t t = 2; t < out.all.size(); ++t) {
      for (std::size_t j = 0; j < skeleton_->joints.size(); ++j) {
        const auto at = [&](std::size_t k) { return to_eigen_double(out.all[k].rotation_xyzw[j]); };
        const Eigen::Quaterniond now = at(t - 1).conjugate() * at(t);
        const Eigen::Quaterniond before = at(t - 2).conjugate() * at(t - 1);
        most = std::max(most, angle_between_rad(now, before) / kDegree);
      }
    }
    return most;
  }

  GenerateStage& stage() { return *stage_; }
  const std::shared_ptr<const Skeleton>& skeleton() { return skeleton_; }

  test::Frames out;
  Frame live;

 private:
  double rate_hz_;
  Source source_;
  clip::Clip body_ = test::raise_take({.take = 99});
  std::shared_ptr<const Skeleton> skeleton_ = body_.skeleton;
  std::unique_ptr<const BoundModel> model_;
  std::optional<GenerateStage> stage_;
  std::uint64_t sent_ = 0;
};

double highest_deg(const ArmStage& body, const std::string& label) {
  double highest = -180.0;
  for (const Frame& frame : body.out.all) {
    if (frame.label.data() == label) highest = std::max(highest, body.left_deg(frame));
  }
  return highest;
}

}  // namespace

TEST_CASE("a live body performs labels where it stands, and goes on as it was", "[body]") {
  for (const double rate_hz : {30.0, 120.0}) {
    INFO(rate_hz << " Hz");
    ArmStage body(rate_hz);
    body.frames(60);
    const Frame before = body.out.all.back();
    CHECK(before.source == Source::kDevice);
    REQUIRE(body.play("raise-both rest"));
    body.frames(1);
    CHECK(body.out.all.back().source == Source::kLabels);
    CHECK(std::string(body.out.all.back().label.data()) == "raise-both");
    CHECK(body.out.all.back().label_probability == 1.0F);
    double off_m = 0.0;
    while (body.stage().performs()) {
      body.frames(1);
      off_m = std::max(off_m, body.off_m(body.out.all.back()));
      REQUIRE(body.out.all.size() < 10'000);
    }
    CHECK(off_m < 1e-4);
    CHECK(highest_deg(body, "raise-both") == Approx(62.0).margin(4.0));
    CHECK(body.roughest_deg() < 5.0 * (30.0 / rate_hz));
    body.frames(30);
    CHECK(body.out.all.back().source == Source::kDevice);
    CHECK(body.left_deg(body.out.all.back()) == Approx(body.left_deg(body.live)).margin(0.2));
  }
}

TEST_CASE("a body that only performs stands as it was given, and holds its last pose", "[body]") {
  ArmStage body(30.0, Source::kLabels);
  body.frames(10);
  const Frame stands = body.out.all.back();
  CHECK(stands.quality == Quality::kHeld);
  CHECK(body.left_deg(stands) == Approx(body.left_deg(body.live)).margin(0.01));
  CHECK(body.off_m(stands) < 1e-4);
  REQUIRE(body.play("raise-left"));
  body.finish();
  CHECK(highest_deg(body, "raise-left") == Approx(62.0).margin(4.0));
  CHECK(body.roughest_deg() < 5.0);
  body.frames(5);
  const Frame held = body.out.all.back();
  CHECK(held.quality == Quality::kHeld);
  CHECK(body.left_deg(held) > body.left_deg(stands) + 60.0);
  CHECK(body.off_m(held) < 1e-4);
}

TEST_CASE("another model of a body leads back from where it is", "[body]") {
  ArmStage body;
  gesture::GestureModel other = arms();
  for (auto& mean : other.body->mean) {  // the same rotations about other means are other values
    mean = mean * rotation_exp(Eigen::Vector3d(0.2, -0.1, 0.3));
  }
  const auto bound = bind_model(other, *body.skeleton(), 30.0, "other.gesture");
  REQUIRE(bound.has_value());
  body.frames(40);
  REQUIRE(body.play("raise-left"));
  body.frames(25);
  REQUIRE(body.stage().use(bound->get()));
  body.frames(1);
  CHECK(body.stage().performs());
  body.finish();
  CHECK(body.roughest_deg() < 15.0);  // a raised arm stops at once; a jump is some 100 degrees
  body.frames(5);
  CHECK(body.left_deg(body.out.all.back()) == Approx(body.left_deg(body.live)).margin(0.2));
}

TEST_CASE("a body without a model passes, and a performance allocates nothing", "[body]") {
  ArmStage body(120.0);
  body.frames(100);
  body.out.all.reserve(2000);
  const auto before = test::allocations();
  REQUIRE(body.stage().performs() == false);
  for (int i = 0; i < 600; ++i) {
    Frame frame = body.live;
    frame.header.device_ns += 8'333'333LL * (i + 1);
    if (i == 100) {
      gesture::PlayOrder order;
      order.size = 2;
      order.label[0] = 1;
      static_cast<void>(body.stage().command(GenerateStage::kPlay, StageCommand::of(order)));
    }
    if (i == 400) static_cast<void>(body.stage().command(GenerateStage::kStopPlaying, {}));
    body.stage().process({.frame = frame}, body.out);
  }
  CHECK(test::allocations() == before);

  GenerateStage bare(body.skeleton(), {.lag = {.frames = 0}}, 30.0, nullptr);
  test::Frames out;
  Frame labels = body.input();
  labels.source = Source::kLabels;
  bare.process({.frame = labels}, out);
  CHECK(out.all.back().rotation_xyzw == labels.rotation_xyzw);
}

TEST_CASE("the processor time of a body's frames, recognised and performed", "[.bench]") {
  for (const double rate_hz : {30.0, 120.0}) {
    ArmStage body(rate_hz);
    for (const bool performed : {false, true}) {
      body.frames(200);
      if (performed) REQUIRE(body.play("raise-both rest raise-left rest raise-right rest"));
      std::vector<double> us;
      for (int i = 0; performed ? body.stage().performs() : i < 1500; ++i) {
        const double begin_us = test::processor_time_us();
        body.frames(1);
        us.push_back(test::processor_time_us() - begin_us);
      }
      std::cout << rate_hz << " Hz, " << arms().channels() / 3 << " joints, "
                << (performed ? "performed: " : "recognised: ") << test::time_figures(us) << "\n";
    }
  }
}

TEST_CASE("a model is refused where its channels are not", "[body]") {
  const Skeleton hand = hand_skeleton(Side::kLeft);
  const Skeleton body = *test::raise_take({}).skeleton;
  CHECK(bind_model(arms(), hand, 30.0, "a").error().message.find("is a hand") != std::string::npos);
  CHECK(bind_model(test::toy_gesture_model(), body, 30.0, "a").error().message.find("is none") !=
        std::string::npos);
  Skeleton armless = body;
  for (Joint& joint : armless.joints) {
    if (joint.bone == Bone::kLeftUpperArm) joint.bone.reset();
  }
  const auto refused = bind_model(arms(), armless, 30.0, "a");
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message.find("leftUpperArm") != std::string::npos);
}

}  // namespace posed::generate

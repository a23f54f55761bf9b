// `posed calibrate` on an emulated glove behind a pseudo-terminal: from poses to angles.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <deque>

#include "daemon/tools/devices/calibrate_poses.hpp"
#include "drivers/cyberglove/angles.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/angle_map.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "tests/support/posing_glove.hpp"

namespace posed::tools {
namespace {

using drivers::glove::Pose;
using test::PosingGlove;

// Gives these replies, one for each pose; poses beyond the script begin at once.
class ScriptedUser final : public PoseGuide {
 public:
  explicit ScriptedUser(PosingGlove& glove, std::deque<Word> script = {})
      : glove_(glove), script_(std::move(script)) {}

  void want(Pose pose) override {
    asked.push_back(pose);
    glove_.hold(pose);
  }
  Word receive() override {
    if (script_.empty()) return Word::kGo;
    const Word word = script_.front();
    script_.pop_front();
    return word;
  }
  void show(const GloveSource::Raw&, const GloveSource::Valid&, PosePhase phase, double left_s,
            double whole_s) override {
    ++shown;
    if (phase == PosePhase::kHeld && !(left_s <= whole_s)) ++wrong;
    if (fidgets && phase == PosePhase::kHeld) {
      glove_.hold(left_s > whole_s / 2 ? Pose::kFlat : Pose::kFist);
    }
  }
  void restless(Pose pose, const std::string&) override { moved.push_back(pose); }

  std::vector<Pose> asked, moved;
  std::size_t shown = 0, wrong = 0;
  bool fidgets = false;

 private:
  PosingGlove& glove_;
  std::deque<Word> script_;
};

std::unique_ptr<GloveSource> worn(const PosingGlove& glove) {
  auto source = GloveSource::open(*drivers::find_driver("cyberglove"), {{"port", glove.port()}});
  if (!source) FAIL(source.error().text());
  return std::move(*source);
}

// Some of the angles that every CyberGlove measures.
void check_hand(const HandAngles& seen, Pose pose) {
  const HandAngles wanted = drivers::glove::hand_in(pose);
  for (const char* name : {"index1_x", "middle2_x", "ring1_x", "little2_x", "ring1_y"}) {
    INFO(drivers::glove::kPoseNames[static_cast<std::size_t>(pose)] << " " << name);
    const auto channel = static_cast<std::size_t>(drivers::glove::hand_channel(name));
    CHECK(seen[channel] == Approx(wanted[channel]).margin(0.1));
  }
}

const PosePlan kQuick{.seconds = {0.2, 0.2, 0.2, 0.2}, .ready_s = std::nullopt, .settle_s = 0.3};

}  // namespace

TEST_CASE("a glove calibrated by poses reads the angles of those poses") {
  PosingGlove glove;
  const auto source = worn(glove);
  ScriptedUser user(glove);
  const auto recorded = record_poses(*source, kQuick, user);
  if (!recorded) FAIL(recorded.error().text());
  CHECK(user.asked == std::vector{Pose::kFlat, Pose::kFist, Pose::kThumb, Pose::kSpread});
  CHECK(user.shown > 4);
  CHECK(user.wrong == 0);
  CHECK(user.moved.empty());
  CHECK(source->hand() == Side::kRight);
  const auto& model = source->model();
  const auto fitted = drivers::glove::fit_poses(model, *recorded);
  if (!fitted) FAIL(fitted.error().text());
  CHECK(fitted->warnings.empty());
  // The emulator's gains are the driver's defaults; the fit must recover them, up to the rounding
  // to counts.
  for (const auto& [name, points] : fitted->sensors) {
    INFO(name);
    const auto sensor = std::ranges::find(model.sensors, name, &drivers::glove::Sensor::name);
    REQUIRE(sensor != model.sensors.end());
    for (const auto& point : points) {
      const auto by_default =
          static_cast<double>(sensor->curve.value_at(static_cast<float>(point[0])));
      CHECK(by_default == Approx(point[1]).margin(0.02));
    }
  }
  CHECK(fitted->sensors.size() >= 18);

  // The hand that it makes of what was held is the hand in those poses.
  const drivers::glove::CalibrationFile file{.driver = "cyberglove",
                                             .glove = {},
                                             .user = {},
                                             .parameters = {},
                                             .sensors = fitted->sensors};
  const auto calibration = drivers::glove::make_calibration(model, file, Side::kRight, "");
  if (!calibration) FAIL(calibration.error().text());
  for (const Pose pose : {Pose::kFlat, Pose::kFist, Pose::kSpread}) {
    const auto p = static_cast<std::size_t>(pose);
    check_hand(drivers::glove::angles_of(model, **calibration, (*recorded)[p]), pose);
  }
  const auto drawn = calibrated_hand(model, **calibration, Side::kRight, *recorded, 60, 10);
  REQUIRE(drawn.size() == 10);
  CHECK(drawn.back() == "    flat           fist           thumb         spread    ");
  CHECK(calibrated_hand(model, **calibration, Side::kRight, {}, 60, 10).empty());
}

TEST_CASE("what the sensors of either hand held gives back the hand's angles") {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const auto model = drivers::cyberglove::glove_model(side).value();
    const auto calibration = drivers::glove::default_calibration(model).value();
    for (const Pose pose : {Pose::kFlat, Pose::kFist, Pose::kSpread}) {
      const auto values = drivers::glove::values_of(model, drivers::glove::hand_in(pose)).value();
      std::array<drivers::glove::Held, drivers::glove::kMaxSensors> held{};
      for (std::size_t i = 0; i < values.size(); ++i) {
        const auto& curve = model.sensors[i].curve;  // a line
        const double slope = (static_cast<double>(curve.value[1]) - curve.value[0]) /
                             (static_cast<double>(curve.raw[1]) - curve.raw[0]);
        if (!std::isfinite(values[i])) continue;
        held[i].add(static_cast<float>(curve.raw[0] + (values[i] - curve.value[0]) / slope));
      }
      check_hand(drivers::glove::angles_of(model, *calibration, held), pose);
      held[drivers::cyberglove::kIndexMcp] = {};  // not measured
      const HandAngles seen = drivers::glove::angles_of(model, *calibration, held);
      CHECK_FALSE(
          std::isfinite(seen[static_cast<std::size_t>(drivers::glove::hand_channel("index1_x"))]));
    }
  }
}

TEST_CASE("a pose can be repeated, and a hand that moved during it is reported") {
  PosingGlove glove;
  const auto source = worn(glove);
  using Word = PoseGuide::Word;
  ScriptedUser user(glove, {Word::kBack, Word::kGo, Word::kNothing, Word::kBack, Word::kGo});
  user.fidgets = true;
  const auto recorded = record_poses(
      *source, {.seconds = {0.6, 0.2, 0, 0}, .ready_s = std::nullopt, .settle_s = 0.1}, user);
  if (!recorded) FAIL(recorded.error().text());
  CHECK(user.asked == std::vector{Pose::kFlat, Pose::kFlat, Pose::kFist, Pose::kFlat, Pose::kFist});
  REQUIRE_FALSE(user.moved.empty());
  CHECK(user.moved[0] == Pose::kFlat);
}

TEST_CASE("poses that begin by themselves need no reply of the user") {
  PosingGlove glove;
  const auto source = worn(glove);
  ScriptedUser user(glove, std::deque<PoseGuide::Word>(100'000, PoseGuide::Word::kNothing));
  const auto recorded =
      record_poses(*source, {.seconds = {0.1, 0.1, 0, 0}, .ready_s = 0.2, .settle_s = 0.1}, user);
  if (!recorded) FAIL(recorded.error().text());
  CHECK(user.asked == std::vector{Pose::kFlat, Pose::kFist});
}

TEST_CASE("contacts and repeats are asked for, and may be left out") {
  PosePlan plan;
  CHECK(plan.poses().size() == drivers::glove::kPoses);
  PosingGlove glove;
  const auto source = worn(glove);
  using Word = PoseGuide::Word;
  plan.seconds.fill(0.1);
  plan.settle_s = 0.1;
  ScriptedUser user(glove, {Word::kGo, Word::kGo, Word::kGo, Word::kGo, Word::kEnough});
  const auto recorded = record_poses(*source, plan, user);
  if (!recorded) FAIL(recorded.error().text());
  CHECK(user.asked.size() == 5);
  CHECK(user.asked.back() == Pose::kTouchIndex);
  CHECK(drivers::glove::was_held((*recorded)[3]));
  CHECK_FALSE(drivers::glove::was_held((*recorded)[4]));
  plan.shorten();
  CHECK(plan.poses() == std::vector{Pose::kFlat, Pose::kFist, Pose::kThumb, Pose::kSpread});
}

TEST_CASE("a calibration that the user cancels writes no file and reports that") {
  PosingGlove glove;
  const auto source = worn(glove);
  ScriptedUser user(glove, {PoseGuide::Word::kNothing, PoseGuide::Word::kStop});
  const auto recorded = record_poses(*source, {}, user);
  REQUIRE_FALSE(recorded);
  CHECK(recorded.error().message.contains("no calibration was written"));
}

}  // namespace posed::tools

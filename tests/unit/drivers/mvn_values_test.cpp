// What MVN sends beside the pose: joint angles, kinematics, trackers and the centre of mass as the
// values of a body's samples, with every kind of damage.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "drivers/byte_writer.hpp"
#include "tests/unit/drivers/mvn_rig.hpp"

namespace posed::drivers::mvn {
namespace {

using test::MvnBytes;
using test::MvnSession;

// One item: its ids, then its numbers as MVN sends them.
struct ValueItem {
  std::vector<std::int32_t> ids;
  std::vector<float> numbers;
};

MvnBytes value_datagram(Type type, std::uint32_t sample, const std::vector<ValueItem>& items,
                        std::uint8_t part = 0, bool last = true) {
  BigEndianWriter writer;
  for (const ValueItem& item : items) {
    for (const std::int32_t id : item.ids) writer.i32(id);
    for (const float number : item.numbers) writer.f32(number);
  }
  const Head head{.type = type,
                  .sample = sample,
                  .part = part,
                  .last = last,
                  .items = static_cast<std::uint8_t>(items.size()),
                  .time_ms = sample * 10,
                  .body = kBodySegments};
  return encode_datagram(head, writer.finish());
}

// 1, 2, 3, ... with a rotation of 90 degrees about MVN's Z in front where there is one.
std::vector<float> counted(std::size_t numbers, bool rotation = false) {
  std::vector<float> all;
  if (rotation) all = {std::sqrt(0.5F), 0.0F, 0.0F, std::sqrt(0.5F)};
  for (std::size_t i = all.size(), n = 1; i < numbers; ++i, ++n) {
    all.push_back(static_cast<float>(n));
  }
  return all;
}

// A walker in session that has sent one datagram of each of these groups, and is described so.
struct ValueSession : MvnSession {
  explicit ValueSession(const std::vector<MvnBytes>& first) {
    for (std::uint32_t i = 1; i <= 4; ++i) {
      now_ns = i * kNanosPerSecond / 3;
      feed(test::mvn_datagram(Type::kQuaternion, i));
    }
    for (const MvnBytes& bytes : first) feed(bytes);
    now_ns += kNanosPerSecond;
    feed(test::mvn_datagram(Type::kQuaternion, 5));
    REQUIRE(layouts.size() == 2);
    sink.clear();
  }
  // What the newest sample says, by name; values that are not valid are left out.
  [[nodiscard]] std::map<std::string, float> reported() const {
    std::map<std::string, float> values;
    const Sample& sample = sink.samples.back();
    const auto& names = bodies()[0].samples.names;
    REQUIRE(sample.value_count == names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (sample.valid[i]) values[names[i]] = sample.value[i];
    }
    return values;
  }
  [[nodiscard]] std::string unit_of(const std::string& name) const {
    const auto& samples = bodies()[0].samples;
    const auto found = std::ranges::find(samples.names, name);
    REQUIRE(found != samples.names.end());
    return samples.units[static_cast<std::size_t>(found - samples.names.begin())];
  }
};

// The outcome of a second datagram of the type, in a session that knows the first.
Outcome value_outcome(Type type, const ValueItem& good, const std::vector<ValueItem>& items) {
  ValueSession session({value_datagram(type, 6, {good})});
  session.feed(value_datagram(type, 7, items));
  for (int i = 0; i < kOutcomes; ++i) {
    if (session.sink.count(static_cast<Outcome>(i)) == 0) continue;
    CHECK(session.sink.samples.size() == (i == 0 ? 1U : 0U));
    return static_cast<Outcome>(i);
  }
  return Outcome::kCount;
}

const ValueItem kElbow{{256 * 9 + 1, 256 * 10}, {90.0F, 0.0F, -180.0F}};  // the right one
const ValueItem kFoot{{18}, counted(9)};
const ValueItem kTurnedFoot{{18}, counted(10, true)};
const ValueItem kLongTracker{{1}, counted(16, true)};

}  // namespace

TEST_CASE("mvn: joint angles are radians about posed's axes, named by the lower segment") {
  ValueSession session({value_datagram(Type::kJointAngles, 6, {kElbow})});
  CHECK(session.bodies()[0].samples.names.size() == 66);
  CHECK(session.bodies()[0].samples.names[0] == "L5_angle_x");
  session.feed(value_datagram(Type::kJointAngles, 7, {kElbow}));
  REQUIRE(session.sink.samples.size() == 1);
  CHECK(session.sink.samples[0].header.device_ns == 70'000'000 - 10'000'000);
  const auto reported = session.reported();
  REQUIRE(reported.size() == 3);  // segment 10 is the right forearm
  CHECK(reported.at("RightForeArm_angle_x") == Approx(0.0));
  CHECK(reported.at("RightForeArm_angle_y") == Approx(-3.14159265));
  CHECK(reported.at("RightForeArm_angle_z") == Approx(1.57079633));
  CHECK(session.unit_of("RightForeArm_angle_x") == "rad");
}

TEST_CASE("mvn: kinematics of segments are in posed's axes, each with its unit") {
  ValueSession session({value_datagram(Type::kLinear, 6, {kFoot}),
                        value_datagram(Type::kAngular, 6, {kTurnedFoot})});
  CHECK(session.bodies()[0].samples.names.size() == 23 * (9 + 10));
  session.feed(value_datagram(Type::kLinear, 7, {kFoot}));
  auto reported = session.reported();
  REQUIRE(reported.size() == 9);
  CHECK(reported.at("RightFoot_position_z") == 1.0F);
  CHECK(reported.at("RightFoot_position_x") == 2.0F);
  CHECK(reported.at("RightFoot_position_y") == 3.0F);
  CHECK(reported.at("RightFoot_velocity_z") == 4.0F);
  CHECK(reported.at("RightFoot_acceleration_y") == 9.0F);
  CHECK(session.unit_of("RightFoot_position_x") == "m");
  CHECK(session.unit_of("RightFoot_velocity_x") == "m/s");
  CHECK(session.unit_of("RightFoot_acceleration_x") == "m/s^2");
  session.feed(value_datagram(Type::kAngular, 7, {kTurnedFoot}));
  reported = session.reported();
  REQUIRE(reported.size() == 10);
  CHECK(reported.at("RightFoot_rotation_y") == Approx(std::sqrt(0.5)));  // about the vertical
  CHECK(reported.at("RightFoot_rotation_w") == Approx(std::sqrt(0.5)));
  CHECK(reported.at("RightFoot_rotation_x") == 0.0F);
  CHECK(reported.at("RightFoot_angular_velocity_x") == 2.0F);
  CHECK(reported.at("RightFoot_angular_acceleration_z") == 4.0F);
  CHECK(session.unit_of("RightFoot_angular_velocity_x") == "rad/s");
  CHECK(session.unit_of("RightFoot_angular_acceleration_x") == "rad/s^2");
  CHECK(session.damaged() == 0);
}

TEST_CASE("mvn: trackers come in two lengths") {
  ValueSession brief({value_datagram(Type::kTrackers, 6, {{{1}, counted(10, true)}})});
  CHECK(brief.bodies()[0].samples.names.size() == 23 * 10);
  brief.feed(value_datagram(Type::kTrackers, 7, {{{1}, counted(10, true)}}));
  auto reported = brief.reported();
  REQUIRE(reported.size() == 10);
  CHECK(reported.at("Pelvis_tracker_free_acceleration_z") == 1.0F);
  CHECK(reported.at("Pelvis_tracker_magnetic_field_x") == 5.0F);
  ValueSession whole({value_datagram(Type::kTrackers, 6, {kLongTracker})});
  CHECK(whole.bodies()[0].samples.names.size() == 23 * 16);
  whole.feed(value_datagram(Type::kTrackers, 7, {kLongTracker}));
  reported = whole.reported();
  REQUIRE(reported.size() == 16);
  CHECK(reported.at("Pelvis_tracker_free_acceleration_z") == 1.0F);
  CHECK(reported.at("Pelvis_tracker_acceleration_z") == 4.0F);
  CHECK(reported.at("Pelvis_tracker_angular_velocity_z") == 7.0F);
  CHECK(reported.at("Pelvis_tracker_magnetic_field_z") == 10.0F);
  CHECK(whole.unit_of("Pelvis_tracker_magnetic_field_z") == "1");
}

TEST_CASE("mvn: values of unknown segments and numbers that are none are out of range") {
  for (const std::int32_t id : {0, -1, 69, 256, std::numeric_limits<std::int32_t>::min()}) {
    CHECK(value_outcome(Type::kLinear, kFoot, {{{id}, counted(9)}}) == Outcome::kOutOfRange);
    if (id < -1) continue;  // 256 * id is beyond what 32 bits hold
    const ValueItem joint{{256, 256 * id}, {0.0F, 0.0F, 0.0F}};
    CHECK(value_outcome(Type::kJointAngles, kElbow, {joint}) == Outcome::kOutOfRange);
  }
  CHECK(value_outcome(Type::kJointAngles, kElbow, {{{-256, 512}, {0.0F, 0.0F, 0.0F}}}) ==
        Outcome::kOutOfRange);
  CHECK(value_outcome(Type::kLinear, kFoot, {kFoot, kFoot}) == Outcome::kOutOfRange);
  for (const float wrong : {std::nanf(""), INFINITY}) {
    for (std::size_t i = 0; i < 16; ++i) {
      ValueItem linear = kFoot, angular = kTurnedFoot, tracker = kLongTracker, joint = kElbow;
      linear.numbers[i % 9] = angular.numbers[i % 10] = tracker.numbers[i] = wrong;
      joint.numbers[i % 3] = wrong;
      CHECK(value_outcome(Type::kLinear, kFoot, {linear}) == Outcome::kOutOfRange);
      CHECK(value_outcome(Type::kAngular, kTurnedFoot, {angular}) == Outcome::kOutOfRange);
      CHECK(value_outcome(Type::kTrackers, kLongTracker, {tracker}) == Outcome::kOutOfRange);
      CHECK(value_outcome(Type::kJointAngles, kElbow, {joint}) == Outcome::kOutOfRange);
    }
  }
  ValueItem far = kFoot;
  far.numbers[2] = 2000.0F;  // metres
  CHECK(value_outcome(Type::kLinear, kFoot, {far}) == Outcome::kOutOfRange);
  ValueItem stretched = kTurnedFoot;
  stretched.numbers[0] = 2.0F;
  CHECK(value_outcome(Type::kAngular, kTurnedFoot, {stretched}) == Outcome::kOutOfRange);
}

TEST_CASE("mvn: values of props, fingers and joints that are none are left out") {
  ValueSession session(
      {value_datagram(Type::kLinear, 6, {kFoot}), value_datagram(Type::kJointAngles, 6, {kElbow})});
  session.feed(value_datagram(Type::kLinear, 7, {{{25}, counted(9)}, kFoot, {{68}, counted(9)}}));
  CHECK(session.reported().size() == 9);
  // From the vertical to the pelvis, and from the pelvis to T8.
  session.feed(value_datagram(
      Type::kJointAngles, 7,
      {{{0, 256}, {1.0F, 2.0F, 3.0F}}, kElbow, {{256, 5 * 256}, {1.0F, 2.0F, 3.0F}}}));
  CHECK(session.reported().size() == 3);
  session.feed(value_datagram(Type::kLinear, 8, {}));
  session.feed(value_datagram(Type::kLinear, 9, {{{25}, counted(9)}}));
  CHECK(session.sink.samples.size() == 2);  // nothing of ours, no sample
  // A tracker that does not know how it is turned.
  ValueItem lost = kLongTracker;
  std::fill_n(lost.numbers.begin(), 4, 0.0F);
  ValueSession other({value_datagram(Type::kTrackers, 6, {kLongTracker})});
  other.feed(value_datagram(Type::kTrackers, 7, {lost}));
  CHECK(other.reported().size() == 12);
  CHECK(session.damaged() + other.damaged() == 0);
}

TEST_CASE("mvn: parts of a sample's values count once each, older samples are late") {
  ValueSession session({value_datagram(Type::kLinear, 6, {kFoot})});
  session.feed(value_datagram(Type::kLinear, 8, {kFoot}, 1, true));
  session.feed(value_datagram(Type::kLinear, 8, {{{3}, counted(9)}}, 0, false));
  CHECK(session.sink.samples.size() == 2);
  session.feed(value_datagram(Type::kLinear, 8, {kFoot}, 1, true));
  CHECK(session.sink.count(Outcome::kDuplicate) == 1);
  session.feed(value_datagram(Type::kLinear, 7, {kFoot}));
  CHECK(session.sink.count(Outcome::kLate) == 1);
  CHECK(session.sink.samples.size() == 2);
  session.feed(value_datagram(Type::kLinear, 9, {kFoot}));
  CHECK(session.sink.samples.size() == 3);
}

TEST_CASE("mvn: values that no longer fit into a sample are left out by groups") {
  ValueGroups all;
  all.set();
  const ValuePlaces places = place_values(all);
  CHECK(places.count == 3 + 66 + 207 + 230);
  CHECK(places.begin[static_cast<std::size_t>(ValueGroup::kTrackers)] == ValuePlaces::kNone);
  CHECK(name_values(all).names.size() == places.count);
  CHECK(name_values(all).units.size() == places.count);
  ValueGroups some = all;
  some.reset(static_cast<std::size_t>(ValueGroup::kAngular));
  some.reset(static_cast<std::size_t>(ValueGroup::kLongTrackers));
  CHECK(place_values(some).count == 3 + 66 + 207 + 230);
  CHECK(place_values({}).count == 0);
}

TEST_CASE("mvn: the emulator's values agree with its pose") {
  auto emulator =
      test::mvn_emulator({Type::kQuaternion, Type::kMeta, Type::kScale, Type::kJointAngles,
                          Type::kLinear, Type::kAngular, Type::kTrackers},
                         2);
  MvnSession session;
  session.run(emulator, kNanosPerSecond);
  session.sink.clear();
  session.run(emulator, kNanosPerSecond * 11 / 10);
  CHECK(session.damaged() == 0);
  REQUIRE(session.bodies().size() == 2);
  const auto& names = session.bodies()[0].samples.names;
  REQUIRE(names.size() == 66 + 207 + 230);
  REQUIRE(session.sink.samples.size() == 2 * 10 * 3);  // trackers do not fit beside the others
  REQUIRE(session.sink.frames.size() == 2 * 10);
  const auto value = [&](const Sample& sample, const char* name) {
    const auto at = std::ranges::find(names, name) - names.begin();
    CHECK(sample.valid[static_cast<std::size_t>(at)]);
    return sample.value[static_cast<std::size_t>(at)];
  };
  const Frame& frame = session.sink.frames[0];
  for (std::size_t k = 0; k < 3; ++k) {
    const std::array<const char*, 3> position{"Pelvis_position_x", "Pelvis_position_y",
                                              "Pelvis_position_z"};
    CHECK(value(session.sink.samples[1], position[k]) == frame.root_position_m[k]);
  }
  CHECK(value(session.sink.samples[2], "Pelvis_rotation_y") ==
        Approx(static_cast<double>(frame.rotation_xyzw[0][1])).margin(1e-6));
  // The walker's knee bends about one axis only.
  const JointTable& table = joint_table(true);
  const auto knee =
      static_cast<std::size_t>(std::ranges::find(table.segment, 20) - table.segment.begin());
  const double bent_rad = rotation_log(to_eigen_double(frame.rotation_xyzw[knee]))[0];
  CHECK(value(session.sink.samples[0], "LeftLowerLeg_angle_x") == Approx(bent_rad).margin(1e-5));
}

}  // namespace posed::drivers::mvn

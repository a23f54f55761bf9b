// MVN's stream: each type from the emulator to the decoder, samples in several datagrams, several
// characters, TCP, the options and the golden log.
#include <algorithm>
#include <array>
#include <random>

#include "tests/unit/drivers/mvn_rig.hpp"

namespace posed::drivers::mvn {
namespace {

using test::MvnBytes;
using test::MvnSession;

constexpr std::int64_t kSecond_ns = kNanosPerSecond;

// A frame of the emulator's skeleton with a random pose; angles that type 01 can tell.
Frame any_pose(const Skeleton& skeleton, std::mt19937& random) {
  Frame frame;
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(skeleton.joints.size());
  frame.root_position_m = {0.5F, 1.1F, -2.0F};
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    Eigen::Vector3d v;
    for (int k = 0; k < 3; ++k) v[k] = 0.3 * (static_cast<double>(random() % 2001) / 1000.0 - 1.0);
    frame.rotation_xyzw[j] = from_eigen(rotation_exp(v));
    frame.valid.set(j);
  }
  return frame;
}

// The datagrams of a sample that is split into parts of four segments.
std::vector<MvnBytes> split_sample(std::uint32_t sample, bool fingers = false) {
  return encode_sample(test::mvn_head(Type::kQuaternion, sample, fingers),
                       encode_pose(Type::kQuaternion, test::mvn_pose(fingers)), 24 + 4 * 32 + 5);
}

// A session that knows a person whose samples up to `sample` have come.
struct KnownSession : MvnSession {
  explicit KnownSession(std::uint32_t sample, bool fingers = false) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      now_ns = i * kSecond_ns / 3;
      feed(test::mvn_datagram(Type::kQuaternion, sample - 3 + i, fingers));
    }
    REQUIRE(layouts.size() == 1);
    sink.clear();
  }
};

}  // namespace

TEST_CASE("mvn: each type of pose carries the pose from the emulator to the frame") {
  std::mt19937 random(3);
  for (const Type type : {Type::kEuler, Type::kQuaternion, Type::kUnity}) {
    auto emulator = test::mvn_emulator({type, Type::kMeta, Type::kScale}, 2);
    MvnSession session;
    session.run(emulator, kSecond_ns / 2);
    REQUIRE(session.bodies().size() == 2);
    for (int round = 0; round < 20; ++round) {
      std::array<Frame, 2> sent;
      for (std::size_t body = 0; body < 2; ++body) {
        sent[body] = any_pose(*emulator.skeleton(body), random);
        emulator.pose(body, sent[body]);
      }
      session.sink.clear();
      session.run(emulator, emulator.next_due_ns() + 1);
      REQUIRE(session.sink.frames.size() == 2);
      for (std::size_t i = 0; i < 2; ++i) {
        const std::size_t body = session.sink.bodies[i];
        const Frame& got = session.sink.frames[i];
        CHECK(test::mvn_apart_m(got.root_position_m, sent[body].root_position_m) < 1e-5);
        // 05 has no fingers.
        const bool fingers = type != Type::kUnity && body == 0;
        CHECK(got.joint_count == (fingers ? kSegments : kBodySegments));
        const JointTable& table = joint_table(body == 0);
        for (std::size_t j = 0; j < table.count; ++j) {
          if (table.segment[j] >= kBodySegments && !fingers) continue;
          const std::size_t at = fingers ? j : table.segment[j];
          CHECK(got.valid[at]);
          CHECK(test::mvn_apart_rad(got.rotation_xyzw[at], sent[body].rotation_xyzw[j]) < 2e-6);
        }
      }
    }
    CHECK(session.damaged() == 0);
  }
}

TEST_CASE("mvn: the skeleton is the emulator's, with and without type 13") {
  for (const bool scale : {true, false}) {
    for (const Type type : {Type::kEuler, Type::kQuaternion, Type::kUnity}) {
      auto emulator = test::mvn_emulator({type, scale ? Type::kScale : Type::kTimeCode}, 2);
      MvnSession session;
      session.run(emulator, 3 * kSecond_ns / 2);
      REQUIRE(session.layouts.size() == 1);
      for (std::size_t body = 0; body < 2; ++body) {
        const Skeleton& got = *session.bodies()[body].skeleton;
        const Skeleton& sent = *emulator.skeleton(body);
        CHECK(got.root_joint == 0);
        for (const Joint& joint : got.joints) {
          const int at = sent.joint_index(joint.name);
          REQUIRE(at >= 0);
          CHECK(joint.bone == sent.joints[at].bone);
          if (joint.parent < 0) continue;
          CHECK(got.joints[joint.parent].name == sent.joints[sent.joints[at].parent].name);
          CHECK((joint.offset_m - sent.joints[at].offset_m).norm() < 1e-5);
        }
        CHECK(got.joints.size() >= kBodySegments);
      }
    }
  }
}

TEST_CASE("mvn: in the T-pose no joint of the canonical humanoid is turned") {
  const auto skeleton = skeleton_of(emulated_walker());
  REQUIRE(skeleton);
  int bones = 0;
  for (const Joint& joint : (*skeleton)->joints) {
    bones += joint.bone ? 1 : 0;
    // Feet, too: the line from ankle to toes slopes, but the sole is flat.
    CHECK(angle_between_rad(joint.T_world_joint, Eigen::Quaterniond::Identity()) < 1e-9);
  }
  CHECK(bones == kBones);  // all of them
  const auto& joints = (*skeleton)->joints;
  CHECK(joints[(*skeleton)->joint_of(Bone::kSpine)].name == "L5");
  CHECK(joints[(*skeleton)->joint_of(Bone::kUpperChest)].name == "T8");
}

TEST_CASE("mvn: of several types of one sample the best gives the only frame") {
  // Whatever their order is.
  for (const auto& types : {std::vector{Type::kEuler, Type::kUnity, Type::kQuaternion},
                            std::vector{Type::kQuaternion, Type::kUnity, Type::kEuler},
                            std::vector{Type::kUnity, Type::kQuaternion, Type::kEuler}}) {
    auto all = types;
    all.insert(all.end(), {Type::kMeta, Type::kScale, Type::kJointAngles, Type::kLinear,
                           Type::kAngular, Type::kTrackers, Type::kTimeCode});
    auto emulator = test::mvn_emulator(all, 1);
    MvnSession session;
    session.run(emulator, kSecond_ns / 2);
    session.sink.clear();
    session.run(emulator, 9 * kSecond_ns / 10);
    CHECK(session.sink.frames.size() == 40);
    CHECK(session.sink.frames[5].valid.count() == kSegments);  // of 02: 05 has no fingers
    CHECK(session.sink.count(Outcome::kOk) == 8 * 40);
    CHECK(session.damaged() == 0);
  }
}

TEST_CASE("mvn: a sample that a worse type gave is not given again, and silence brings it back") {
  KnownSession session(10);
  session.feed(test::mvn_datagram(Type::kEuler, 11));  // worse than 02, which has just come
  CHECK(session.sink.frames.empty());
  session.now_ns += kSecond_ns;
  session.feed(test::mvn_datagram(Type::kEuler, 12));
  CHECK(session.sink.frames.size() == 1);
  session.feed(test::mvn_datagram(Type::kQuaternion, 12));
  CHECK(session.sink.frames.size() == 1);
  session.feed(test::mvn_datagram(Type::kQuaternion, 13));
  session.feed(test::mvn_datagram(Type::kEuler, 13));
  CHECK(session.sink.frames.size() == 2);
  CHECK(session.sink.count(Outcome::kOk) == 5);
}

TEST_CASE("mvn: a sample in several datagrams is put together in any order") {
  KnownSession session(10, true);
  std::mt19937 random(5);
  for (std::uint32_t sample = 11; sample < 40; ++sample) {
    auto parts = split_sample(sample, true);
    REQUIRE(parts.size() == 16);
    if (sample > 11) std::shuffle(parts.begin(), parts.end(), random);
    for (const MvnBytes& part : parts) {
      CHECK(session.sink.frames.size() == sample - 11);
      session.feed(part);
    }
  }
  MvnSession whole;
  whole.decoder.use(*session.layouts.back());
  whole.feed(test::mvn_datagram(Type::kQuaternion, 10, true));
  REQUIRE(whole.sink.frames.size() == 1);
  for (const Frame& frame : session.sink.frames) {
    CHECK(test::same_pose(frame, whole.sink.frames[0]));
  }
  CHECK(session.damaged() == 0);
}

TEST_CASE("mvn: a lost part drops the sample and is counted once") {
  KnownSession session(10);
  const auto parts = split_sample(11);
  REQUIRE(parts.size() == 6);
  for (std::size_t lost = 0; lost < parts.size(); ++lost) {
    const auto sample = static_cast<std::uint32_t>(20 + 2 * lost);
    session.sink.clear();
    const auto some = split_sample(sample);
    for (std::size_t i = 0; i < some.size(); ++i) {
      if (i != lost) session.feed(some[i]);
    }
    CHECK(session.sink.frames.empty());
    for (const MvnBytes& part : split_sample(sample + 1)) session.feed(part);
    CHECK(session.sink.frames.size() == 1);
    CHECK(session.sink.count(Outcome::kShort) == 1);
    CHECK(session.sink.count(Outcome::kOk) == 5 + 6);
    session.feed(some[lost]);  // too late
    CHECK(session.sink.count(Outcome::kLate) + session.sink.count(Outcome::kDuplicate) == 1);
  }
}

TEST_CASE("mvn: parts that came twice or contradict each other are counted") {
  KnownSession session(10);
  auto parts = split_sample(11);
  session.feed(parts[0]);
  session.feed(parts[0]);
  CHECK(session.sink.count(Outcome::kDuplicate) == 1);
  for (std::size_t i = 1; i < parts.size(); ++i) session.feed(parts[i]);
  CHECK(session.sink.frames.size() == 1);
  session.feed(parts[2]);  // the whole sample is done
  CHECK(session.sink.count(Outcome::kDuplicate) == 2);
  parts = split_sample(12);
  parts[1][10] |= std::byte{0x80};  // two last parts
  for (const MvnBytes& part : parts) session.feed(part);
  CHECK(session.sink.frames.size() == 1);
  CHECK(session.sink.count(Outcome::kShort) == 1);      // too few segments for a person
  CHECK(session.sink.count(Outcome::kDuplicate) == 6);  // the rest: the sample is done
}

TEST_CASE("mvn: late and doubled samples are counted for each character") {
  KnownSession session(10);
  for (const std::uint32_t sample : {12U, 11U, 12U, 13U, 13U, 14U}) {
    session.feed(test::mvn_datagram(Type::kQuaternion, sample));
  }
  CHECK(session.sink.frames.size() == 3);
  CHECK(session.sink.count(Outcome::kLate) == 1);
  CHECK(session.sink.count(Outcome::kDuplicate) == 2);
  Head head = test::mvn_head(Type::kQuaternion, 3, false);
  head.character = 9;  // has numbers of its own
  session.feed(encode_datagram(head, encode_pose(Type::kQuaternion, test::mvn_pose(false))));
  CHECK(session.sink.count(Outcome::kForeign) == 1);  // not described yet
}

TEST_CASE("mvn: the time code is the device's time, once it moves") {
  KnownSession session(10);
  const auto feed = [&](std::uint32_t sample, std::uint32_t time_ms) {
    Head head = test::mvn_head(Type::kQuaternion, sample, false);
    head.time_ms = time_ms;
    session.feed(encode_datagram(head, encode_pose(Type::kQuaternion, test::mvn_pose(false))));
    return session.sink.frames.back().header.device_ns;
  };
  const std::int64_t start_ns = feed(11, 110);
  CHECK(feed(12, 120) - start_ns == 10'000'000);
  CHECK(feed(13, 4'000'000'000) > start_ns);
  const std::int64_t before_ns = feed(14, 4'294'967'290);
  CHECK(feed(15, 4) - before_ns == 10'000'000);              // wrapped
  CHECK(feed(16, 3'999'999'000) - before_ns == 10'000'000);  // started again
  CHECK(feed(17, 3'999'999'010) - before_ns == 20'000'000);

  MvnSession still;
  still.decoder.use(*session.layouts.back());
  for (std::uint32_t sample = 1; sample < 4; ++sample) {
    Head head = test::mvn_head(Type::kQuaternion, sample, false);
    head.time_ms = 77;
    still.feed(encode_datagram(head, encode_pose(Type::kQuaternion, test::mvn_pose(false))));
    CHECK(still.sink.frames.back().header.device_ns == kNoTime_ns);
  }
}

TEST_CASE("mvn: characters have one clock, come and go") {
  auto emulator = test::mvn_emulator({Type::kQuaternion, Type::kMeta, Type::kScale}, 2);
  emulator.set_present(1, false);
  MvnSession session;
  session.run(emulator, 5 * kSecond_ns / 2);
  REQUIRE(session.layouts.size() == 1);
  REQUIRE(session.bodies().size() == 1);
  CHECK(session.bodies()[0].name == "Walker");
  emulator.set_present(1, true);
  session.run(emulator, 9 * kSecond_ns / 2);
  REQUIRE(session.layouts.size() == 2);
  REQUIRE(session.bodies().size() == 2);
  CHECK(session.bodies()[1].name == "Waver");
  session.sink.clear();
  session.run(emulator, emulator.next_due_ns() + 1);
  REQUIRE(session.sink.frames.size() == 2);
  CHECK(session.sink.frames[0].header.device_ns == session.sink.frames[1].header.device_ns);
  emulator.set_present(0, false);
  session.run(emulator, 7 * kSecond_ns);
  REQUIRE(session.layouts.size() == 3);
  REQUIRE(session.bodies().size() == 1);
  CHECK(session.bodies()[0].name == "Waver");
  emulator.set_present(0, true);  // its name is remembered
  session.run(emulator, 7 * kSecond_ns + kSecond_ns / 10);
  REQUIRE(session.layouts.size() == 4);
  CHECK(session.bodies()[0].name == "Walker");
  CHECK(session.damaged() == 0);
}

TEST_CASE("mvn: nobody leaves while MVN pauses") {
  auto emulator = test::mvn_emulator({Type::kQuaternion, Type::kMeta, Type::kScale}, 2);
  MvnSession session;
  session.run(emulator, kSecond_ns);
  REQUIRE(session.bodies().size() == 2);
  const std::size_t before = session.layouts.size();
  MvnBytes skipped;
  emulator.emit(20 * kSecond_ns, skipped);
  session.run(emulator, 22 * kSecond_ns);
  CHECK(session.layouts.size() == before);
}

TEST_CASE("mvn: without a name a character has a number, and a name makes a body of it") {
  auto emulator = test::mvn_emulator({Type::kQuaternion}, 2);
  MvnSession session;
  session.run(emulator, kSecond_ns - 1);
  CHECK(session.layouts.empty());  // a name may come
  CHECK(session.sink.count(Outcome::kForeign) == 200);
  session.run(emulator, 2 * kSecond_ns);
  REQUIRE(session.layouts.size() == 1);
  CHECK(session.bodies()[0].name == "character-0");
  CHECK(session.bodies()[1].name == "character-1");
  const Head head{.type = Type::kMeta, .character = 1, .body = kBodySegments};
  session.feed(encode_datagram(head, encode_meta("  Bo\xff\x1b \r")));
  REQUIRE(session.layouts.size() == 2);
  CHECK(session.bodies()[0].name == "character-0");
  CHECK(session.bodies()[1].name == "Bo\\xff\\x1b");
}

TEST_CASE("mvn: another figure changes the skeleton, a joint that gives way does not") {
  const auto feed = [](MvnSession& session, std::uint32_t sample, float arm_m) {
    CharacterPose pose = test::mvn_pose(false);
    for (const std::size_t s : {8U, 9U, 10U}) pose.segments[s].position_m[1] += arm_m;
    session.now_ns += kSecond_ns / 10;
    session.feed(encode_datagram(test::mvn_head(Type::kQuaternion, sample, false),
                                 encode_pose(Type::kQuaternion, pose)));
  };
  KnownSession session(10);
  std::uint32_t sample = 10;
  for (int i = 0; i < 40; ++i) feed(session, ++sample, 0.015F);
  CHECK(session.layouts.size() == 1);
  feed(session, ++sample, 0.3F);  // a single slip
  for (int i = 0; i < 40; ++i) feed(session, ++sample, 0.0F);
  CHECK(session.layouts.size() == 1);
  for (int i = 0; i < 40; ++i) feed(session, ++sample, 0.1F);
  CHECK(session.layouts.size() == 2);
  const Joint& arm = session.bodies()[0].skeleton->joints[8];
  CHECK(arm.offset_m.norm() > 0.16);
  CHECK(session.damaged() == 0);
}

TEST_CASE("mvn: gloves add joints, and their silence makes them invalid") {
  KnownSession session(10);
  session.now_ns += 2 * kSecond_ns / 5;
  session.feed(test::mvn_datagram(Type::kQuaternion, 11, true));
  REQUIRE(session.layouts.size() == 2);
  CHECK(session.sink.frames.back().joint_count == kBodySegments);
  session.feed(test::mvn_datagram(Type::kQuaternion, 12, true));
  CHECK(session.sink.frames.back().joint_count == kSegments);
  CHECK(session.sink.frames.back().valid.count() == kSegments);
  session.feed(test::mvn_datagram(Type::kQuaternion, 13, false));
  CHECK(session.sink.frames.back().joint_count == kSegments);
  CHECK(session.sink.frames.back().valid.count() == kBodySegments);
  CHECK(session.layouts.size() == 2);
}

TEST_CASE("mvn: the centre of mass is a sample of its body") {
  auto emulator =
      test::mvn_emulator({Type::kQuaternion, Type::kCentreOfMass, Type::kMeta, Type::kScale}, 1);
  MvnSession session;
  session.run(emulator, kSecond_ns);
  REQUIRE(session.bodies().size() == 1);
  CHECK(session.bodies()[0].samples.names.size() == 3);
  CHECK(session.bodies()[0].samples.units == std::vector<std::string>(3, "m"));
  session.sink.clear();
  session.run(emulator, 2 * kSecond_ns);
  REQUIRE(session.sink.samples.size() == 100);
  REQUIRE(session.sink.frames.size() == 100);
  for (std::size_t i = 0; i < 100; ++i) {
    const Sample& sample = session.sink.samples[i];
    CHECK(sample.value_count == 3);
    CHECK(sample.header.device_ns == session.sink.frames[i].header.device_ns);
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(sample.value[k] == session.sink.frames[i].root_position_m[k]);
    }
  }
  CHECK(session.damaged() == 0);
}

TEST_CASE("mvn: a frame carries the time code of its sample or of the one before") {
  KnownSession session(10);
  const auto timecode_of_frame = [&](std::uint32_t sample) {
    session.sink.clear();
    session.feed(test::mvn_datagram(Type::kQuaternion, sample));
    REQUIRE(session.sink.frames.size() == 1);
    return std::string(view_of(session.sink.frames[0].timecode));
  };
  const auto notify = [&](std::uint32_t sample, std::string_view text) {
    session.feed(encode_datagram(test::mvn_head(Type::kTimeCode, sample, false),
                                 std::as_bytes(std::span(text))));
  };
  CHECK(timecode_of_frame(11).empty());
  // A size and the text, as the vendor's SDK reads it (hrii-iit/xsens_mvn_ros,
  // timecodedatagram.cpp).
  const std::string_view sized(
      "\0\0\0\x0C"
      "01:02:03.004",
      16);
  CHECK(std::ranges::equal(encode_timecode(sized.substr(4)), std::as_bytes(std::span(sized))));
  notify(12, sized);
  CHECK(timecode_of_frame(12) == "01:02:03.004");
  CHECK(timecode_of_frame(13) == "01:02:03.004");  // its own comes behind it
  CHECK(timecode_of_frame(14).empty());            // MVN has stopped sending it
  notify(15, std::string_view("01:02:03.034\0", 13));
  CHECK(timecode_of_frame(15) == "01:02:03.034");
  notify(16, "no time code");
  CHECK(timecode_of_frame(16).empty());
  CHECK(session.damaged() == 0);
  notify(17, std::string_view("\0\0\0\x0D"
                              "01:02:03.004",
                              16));
  CHECK(session.sink.count(Outcome::kShort) == 1);
}

TEST_CASE("mvn: more characters than there is room for are counted") {
  MvnSession session;
  for (std::uint32_t round = 0; round < 25; ++round) {
    session.now_ns = round * kSecond_ns / 20;
    for (std::uint8_t id = 0; id < kMaxCharacters + 1; ++id) {
      Head head = test::mvn_head(Type::kQuaternion, round, false);
      head.character = id;
      session.feed(encode_datagram(head, encode_pose(Type::kQuaternion, test::mvn_pose(false))));
    }
  }
  CHECK(session.bodies().size() <= kMaxCharacters);
  CHECK(session.bodies().size() >= kMaxCharacters - 2);
}
}  // namespace posed::drivers::mvn

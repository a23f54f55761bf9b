// MVN's datagrams, one by one: real ones, their bytes as drawn, and every kind of damage.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>

#include "tests/support/pcapng.hpp"
#include "tests/unit/drivers/mvn_rig.hpp"

namespace posed::drivers::mvn {
namespace {

using test::MvnBytes;
using test::MvnSession;

constexpr std::string_view kReal = "data/streams/xsens_mxtp/";

CharacterPose decoded(const MvnBytes& bytes) {
  Datagram datagram;
  REQUIRE(decode_datagram(bytes, datagram) == Outcome::kOk);
  CharacterPose pose;
  REQUIRE(decode_pose(datagram.head, datagram.payload, pose) == Outcome::kOk);
  return pose;
}

// A session that knows the walker from types 12 and 13 and its first sample.
struct WalkerSession : MvnSession {
  WalkerSession() {
    const Head head{.type = Type::kMeta, .items = 1, .body = kBodySegments};
    feed(encode_datagram(head, encode_meta("Ann")));
    std::array<Vec3f, kBodySegments> standing{};
    const CharacterPose pose = test::mvn_pose(false);
    for (std::size_t i = 0; i < kBodySegments; ++i) standing[i] = pose.segments[i].position_m;
    Head scale = head;
    scale.type = Type::kScale;
    feed(encode_datagram(scale, encode_scale(standing)));
    feed(test::mvn_datagram(Type::kQuaternion, 1));
    REQUIRE(layouts.size() == 1);
    sink.clear();
  }
};

// What a fresh walker's session makes of one datagram; it gives no frame unless it is kOk.
Outcome outcome_of(const MvnBytes& bytes) {
  WalkerSession session;
  session.feed(bytes);
  int outcomes = 0;
  Outcome got = Outcome::kOk;
  for (int i = 0; i < kOutcomes; ++i) {
    outcomes += session.sink.count(static_cast<Outcome>(i));
    if (session.sink.count(static_cast<Outcome>(i)) > 0) got = static_cast<Outcome>(i);
  }
  CHECK(outcomes == 1);
  CHECK(session.sink.frames.size() == (got == Outcome::kOk ? 1U : 0U));
  return got;
}

void put_float(MvnBytes& bytes, std::size_t at, float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  for (std::size_t i = 0; i < 4; ++i) {
    bytes.at(at + i) = static_cast<std::byte>(bits >> (24 - 8 * i) & 0xFF);
  }
}

// Where a number of an item stands in a datagram of type 02: 0 to 2 x, y, z; 3 to 6 w, x, y, z.
std::size_t number_at(std::size_t item, std::size_t number) {
  return kHeadBytes + 32 * item + 4 + 4 * number;
}

}  // namespace

TEST_CASE("mvn: real datagrams of types 01 and 02 of one instant hold the same pose") {
  const auto euler = test::shared(std::string(kReal) + "mxtp01.bin");
  const auto quaternion = test::shared(std::string(kReal) + "mxtp02.bin");
  if (!euler || !quaternion) SKIP_WITHOUT_SHARED();
  const CharacterPose a = decoded(test::file_bytes(*euler));
  const CharacterPose b = decoded(test::file_bytes(*quaternion));
  double worst_m = 0.0;
  double worst_rad = 0.0;
  for (std::size_t i = 0; i < kBodySegments; ++i) {
    CHECK(a.segments[i].seen);
    worst_m =
        std::max(worst_m, test::mvn_apart_m(a.segments[i].position_m, b.segments[i].position_m));
    worst_rad = std::max(
        worst_rad, test::mvn_apart_rad(a.segments[i].rotation_xyzw, b.segments[i].rotation_xyzw));
  }
  std::printf("mvn: types 01 and 02 differ by %.1e m and %.1e rad\n", worst_m, worst_rad);
  CHECK(worst_m < 1e-4);
  CHECK(worst_rad < 1e-5);
  CHECK(b.segments[0].position_m[1] == Approx(1.048).margin(0.001));  // the pelvis is up
}

TEST_CASE("mvn: real datagrams give a named person with the proportions of the T-pose") {
  const auto file = [](const char* type) {
    return test::shared(std::string(kReal) + "mxtp" + type + ".bin");
  };
  if (!file("02") || !file("12") || !file("13")) SKIP_WITHOUT_SHARED();
  MvnSession session;
  for (const char* type : {"12", "13", "02"}) session.feed(test::file_bytes(*file(type)));
  REQUIRE(session.layouts.size() == 1);
  REQUIRE(session.bodies().size() == 1);
  CHECK(session.bodies()[0].name == "Factory");
  const Skeleton& skeleton = *session.bodies()[0].skeleton;
  REQUIRE(skeleton.joints.size() == kBodySegments);
  CHECK(skeleton.joints[0].offset_m.y() == Approx(1.052).margin(0.001));
  const int forearm = skeleton.joint_of(Bone::kLeftLowerArm);
  REQUIRE(forearm >= 0);
  CHECK(skeleton.joints[forearm].offset_m.x() == Approx(0.3451).margin(1e-4));  // left is +X
  const int toes = skeleton.joint_of(Bone::kRightToes);
  CHECK(skeleton.joints[toes].offset_m.z() == Approx(0.2009).margin(1e-4));  // forward is +Z
  // The pose on this skeleton puts every segment where the datagram has it, but for the millimetres
  // by which MVN's joints give way.
  MvnBytes again = test::file_bytes(*file("02"));
  again[9] = static_cast<std::byte>(std::to_integer<unsigned>(again[9]) + 1);  // the next sample
  session.feed(again);
  REQUIRE(session.sink.frames.size() == 1);
  const Frame& frame = session.sink.frames[0];
  const CharacterPose pose = decoded(again);
  std::array<Eigen::Quaterniond, kBodySegments> turned;
  std::array<Eigen::Vector3d, kBodySegments> place;
  double worst_m = 0.0;
  for (std::size_t j = 0; j < kBodySegments; ++j) {
    const Joint& joint = skeleton.joints[j];
    const Eigen::Quaterniond local = to_eigen_double(frame.rotation_xyzw[j]);
    const Vec3f& p = pose.segments[j].position_m;
    turned[j] = local;
    place[j] = {p[0], p[1], p[2]};
    if (joint.parent < 0) continue;
    const auto above = static_cast<std::size_t>(joint.parent);
    turned[j] = turned[above] * local;
    place[j] = place[above] + turned[above] * joint.offset_m;
    worst_m = std::max(worst_m, (place[j] - Eigen::Vector3d(p[0], p[1], p[2])).norm());
    CHECK(angle_between_rad(turned[j], to_eigen_double(pose.segments[j].rotation_xyzw)) < 1e-6);
  }
  std::printf("mvn: the farthest segment lies %.1f mm from the skeleton's\n", 1000.0 * worst_m);
  CHECK(worst_m < 0.02);
}

TEST_CASE("mvn: a real point of time") {
  const auto path = test::shared(std::string(kReal) + "mxtp02.bin");
  if (!path) SKIP_WITHOUT_SHARED();
  Datagram datagram;
  REQUIRE(decode_datagram(test::file_bytes(*path), datagram) == Outcome::kOk);
  CHECK(datagram.head.last);
  CHECK(datagram.head.part == 0);
  CHECK(datagram.head.items == kBodySegments);
  CHECK(datagram.head.sample == 6681);
  CHECK(datagram.head.time_ms == 27'837);  // 6681 samples at 240 Hz
}

TEST_CASE("mvn: a datagram has the bytes of its drawing") {
  const Head head{.type = Type::kCentreOfMass,
                  .sample = 0x01020304,
                  .part = 2,
                  .last = true,
                  .items = 1,
                  .time_ms = 0x0A0B0C0D,
                  .character = 7,
                  .body = 23,
                  .props = 1,
                  .fingers = 40};
  const MvnBytes bytes = encode_datagram(head, encode_centre_of_mass({1.0F, 0.0F, -2.0F}));
  const std::array<unsigned, 36> expected{'M', 'X', 'T', 'P', '2', '4', 1, 2, 3, 4, 0x82, 1, 0xA,
                                          0xB, 0xC, 0xD, 7, 23, 1, 40, 0, 0, 0, 12,
                                          // forward, left, up: posed's z, x, y
                                          0xC0, 0, 0, 0, 0x3F, 0x80, 0, 0, 0, 0, 0, 0};
  REQUIRE(bytes.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(std::to_integer<unsigned>(bytes[i]) == expected[i]);
  }
  Datagram datagram;
  REQUIRE(decode_datagram(bytes, datagram) == Outcome::kOk);
  GroupValues values;
  CHECK(decode_values(datagram, values) == Outcome::kOk);
  CHECK(values.group == ValueGroup::kCentreOfMass);
  CHECK(Vec3f{values.value[0], values.value[1], values.value[2]} == Vec3f{1.0F, 0.0F, -2.0F});
  CHECK(values.valid.count() == 3);
}

TEST_CASE("mvn: type 01 turns about X, then Y, then Z, in centimetres and degrees") {
  MvnBytes payload(28 * kBodySegments);
  const std::array<float, 6> pelvis{10.0F, 100.0F, -50.0F, 90.0F, 0.0F, 90.0F};
  for (std::size_t i = 0; i < pelvis.size(); ++i) put_float(payload, 4 + 4 * i, pelvis[i]);
  CharacterPose pose;
  const Head head = test::mvn_head(Type::kEuler, 1, false);
  REQUIRE(decode_pose(head, payload, pose) == Outcome::kOk);
  CHECK(test::mvn_apart_m(pose.segments[0].position_m, {0.1F, 1.0F, -0.5F}) < 1e-6);
  const Eigen::Quaterniond q = to_eigen_double(pose.segments[0].rotation_xyzw);
  CHECK((q * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm() < 1e-6);
  CHECK((q * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm() < 1e-6);
}

TEST_CASE("mvn: the angles of type 01 make the rotation also where X and Z are nearly one axis") {
  CharacterPose pose, back;
  for (const double off_rad : {0.0, 1e-7, 1e-5, 1e-3}) {
    pose.segments[0].rotation_xyzw = from_eigen(
        axis_rotation(Axis::kZ, 0.7) * axis_rotation(Axis::kY, 0.5 * std::numbers::pi - off_rad) *
        axis_rotation(Axis::kX, -0.4));
    const Head head = test::mvn_head(Type::kEuler, 1, false);
    const auto payload = encode_pose(Type::kEuler, pose);
    REQUIRE(decode_pose(head, payload, back) == Outcome::kOk);
    CHECK(test::mvn_apart_rad(back.segments[0].rotation_xyzw, pose.segments[0].rotation_xyzw) <
          1e-6);
  }
}

TEST_CASE("mvn: every datagram that is cut is short, and one that goes on, too") {
  std::vector<MvnBytes> all;
  for (const Type type : {Type::kEuler, Type::kQuaternion, Type::kUnity}) {
    all.push_back(test::mvn_datagram(type, 2));
  }
  Head head{.type = Type::kMeta, .sample = 2, .items = 1, .body = kBodySegments};
  all.push_back(encode_datagram(head, encode_meta("Ann")));
  head.type = Type::kScale;
  all.push_back(encode_datagram(head, encode_scale(std::array<Vec3f, kBodySegments>{})));
  head.type = Type::kCentreOfMass;
  all.push_back(encode_datagram(head, encode_centre_of_mass({})));
  for (const Type type : {Type::kJointAngles, Type::kLinear, Type::kAngular, Type::kTrackers}) {
    head.type = type;
    const MvnBytes payload = encode_values(type, test::mvn_pose(false));
    head.items = static_cast<std::uint8_t>(payload.size() / item_bytes(type));
    all.push_back(encode_datagram(head, payload));
  }
  WalkerSession session;
  for (const MvnBytes& bytes : all) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      Datagram datagram;
      CHECK(decode_datagram(std::span(bytes).first(size), datagram) == Outcome::kShort);
    }
    MvnBytes longer = bytes;
    longer.push_back({});
    Datagram datagram;
    CHECK(decode_datagram(longer, datagram) == Outcome::kShort);
    // A head that agrees with the cut: only the payload's own counts tell.
    for (std::size_t size = kHeadBytes; size < bytes.size(); ++size) {
      MvnBytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      cut[22] = static_cast<std::byte>((size - kHeadBytes) >> 8);
      cut[23] = static_cast<std::byte>((size - kHeadBytes) & 0xFF);
      session.sink.clear();
      session.feed(cut);
      CHECK(session.sink.count(Outcome::kShort) == 1);
      CHECK(session.sink.frames.empty());
    }
  }
}

TEST_CASE("mvn: what is not from MVN, or of no known type, is foreign") {
  MvnBytes bytes = test::mvn_datagram(Type::kQuaternion, 2);
  CHECK(outcome_of(bytes) == Outcome::kOk);
  bytes[0] = std::byte{'m'};
  CHECK(outcome_of(bytes) == Outcome::kForeign);
  for (const std::string_view type : {"03", "11", "99", "0x", "  "}) {
    bytes = test::mvn_datagram(Type::kQuaternion, 2);
    bytes[4] = static_cast<std::byte>(type[0]);
    bytes[5] = static_cast<std::byte>(type[1]);
    CHECK(outcome_of(bytes) == Outcome::kForeign);
  }
}

TEST_CASE("mvn: numbers that are no pose are out of range, and an unseen segment is not valid") {
  const auto with = [](std::size_t item, std::size_t number, float value) {
    MvnBytes bytes = test::mvn_datagram(Type::kQuaternion, 2);
    put_float(bytes, number_at(item, number), value);
    return bytes;
  };
  for (const float wrong : {std::nanf(""), INFINITY, -2000.0F}) {
    CHECK(outcome_of(with(0, 1, wrong)) == Outcome::kOutOfRange);
    CHECK(outcome_of(with(22, 2, wrong)) == Outcome::kOutOfRange);
    CHECK(outcome_of(with(7, 3, wrong)) == Outcome::kOutOfRange);
  }
  CHECK(outcome_of(with(7, 3, 0.5F)) == Outcome::kOutOfRange);  // no unit length
  MvnBytes euler = test::mvn_datagram(Type::kEuler, 2);
  put_float(euler, kHeadBytes + 16, std::nanf(""));
  Datagram datagram;
  REQUIRE(decode_datagram(euler, datagram) == Outcome::kOk);
  CharacterPose pose;
  CHECK(decode_pose(datagram.head, datagram.payload, pose) == Outcome::kOutOfRange);

  MvnBytes unseen = test::mvn_datagram(Type::kQuaternion, 2);
  for (std::size_t number = 3; number < 7; ++number) put_float(unseen, number_at(9, number), 0.0F);
  WalkerSession session;
  session.feed(test::mvn_datagram(Type::kQuaternion, 2));
  unseen[9] = std::byte{3};
  session.feed(unseen);
  REQUIRE(session.sink.frames.size() == 2);
  const Frame& whole = session.sink.frames[0];
  const Frame& part = session.sink.frames[1];
  CHECK(whole.valid.count() == kBodySegments);
  CHECK(part.valid.count() == kBodySegments - 1);
  CHECK_FALSE(part.valid[9]);
  CHECK(part.rotation_xyzw[9] == kIdentity);
  // The hand stays where it is in the room.
  const auto hand = [](const Frame& frame) {
    return to_eigen_double(frame.rotation_xyzw[9]) * to_eigen_double(frame.rotation_xyzw[10]);
  };
  CHECK(angle_between_rad(hand(whole), hand(part)) < 1e-6);
}

TEST_CASE("mvn: segments are found by their place, behind props and with gloves") {
  const CharacterPose pose = test::mvn_pose(true);
  const MvnBytes items = encode_pose(Type::kQuaternion, pose);
  for (const bool old : {false, true}) {
    for (std::size_t props = 0; props <= kMaxProps; ++props) {
      MvnBytes payload(items.begin(), items.begin() + 32 * kBodySegments);
      payload.insert(payload.end(), 32 * props, std::byte{0x7F});  // whatever a prop says
      payload.insert(payload.end(), items.begin() + 32 * kBodySegments, items.end());
      Head head = test::mvn_head(Type::kQuaternion, 1, true);
      head.props = static_cast<std::uint8_t>(props);
      head.items = static_cast<std::uint8_t>(kSegments + props);
      head.old = old;
      MvnBytes bytes = encode_datagram(head, payload);
      if (old) std::fill(bytes.begin() + 17, bytes.begin() + 24, std::byte{});
      const CharacterPose got = decoded(bytes);
      CHECK(got.fingers);
      for (std::size_t i = 0; i < kSegments; ++i) {
        CHECK(test::mvn_apart_m(got.segments[i].position_m, pose.segments[i].position_m) < 1e-6);
      }
    }
  }
}

TEST_CASE("mvn: segments that come in another order are no pose") {
  test::MvnBytes items = encode_pose(Type::kQuaternion, test::mvn_pose(false));
  const Head head = test::mvn_head(Type::kQuaternion, 1, false);
  CharacterPose pose;
  REQUIRE(decode_pose(head, items, pose) == Outcome::kOk);
  std::swap_ranges(items.begin(), items.begin() + 32, items.begin() + 22 * 32);
  CHECK(decode_pose(head, items, pose) == Outcome::kOutOfRange);
}

TEST_CASE("mvn: datagrams from before MVN 2019 are told by their items and their length") {
  WalkerSession session;
  MvnBytes old = test::mvn_datagram(Type::kQuaternion, 2);
  std::fill(old.begin() + 17, old.begin() + 24, std::byte{});
  session.feed(old);
  CHECK(session.sink.count(Outcome::kOk) == 1);
  CHECK(session.sink.frames.size() == 1);
  for (std::size_t size = kHeadBytes; size < old.size(); ++size) {
    CHECK(outcome_of({old.begin(), old.begin() + static_cast<std::ptrdiff_t>(size)}) ==
          Outcome::kShort);
  }
  old[11] = std::byte{22};  // items
  CHECK(outcome_of(old) == Outcome::kShort);
}

TEST_CASE("mvn: a head that names segments that no character has is out of range") {
  const auto with = [](std::size_t at, unsigned value) {
    MvnBytes bytes = test::mvn_datagram(Type::kQuaternion, 2);
    bytes[at] = static_cast<std::byte>(value);
    return bytes;
  };
  CHECK(outcome_of(with(17, 22)) == Outcome::kOutOfRange);
  CHECK(outcome_of(with(18, 5)) == Outcome::kOutOfRange);
  CHECK(outcome_of(with(19, 20)) == Outcome::kOutOfRange);
  CHECK(outcome_of(with(19, 40)) == Outcome::kOk);  // the fingers are just not there
  CHECK(outcome_of(with(18, 2)) == Outcome::kOk);
}

TEST_CASE("mvn: the character's data are checked, counts before memory") {
  std::string_view name;
  const auto meta = [&](std::string_view text) {
    name = {};
    static MvnBytes payload;
    payload.assign(4, std::byte{});
    payload[3] = static_cast<std::byte>(text.size());
    const auto bytes = std::as_bytes(std::span(text));
    payload.insert(payload.end(), bytes.begin(), bytes.end());
    return decode_meta(payload, name);
  };
  CHECK(meta("xmid:1\nname:Ann\n") == Outcome::kOk);
  CHECK(name == "Ann");
  CHECK(meta("name:Bo") == Outcome::kOk);
  CHECK(name == "Bo");
  CHECK(meta("surname:Bo\ncolor:ff0000\n\n") == Outcome::kOk);
  CHECK(name.empty());
  MvnBytes greedy(4, std::byte{0xFF});
  CHECK(decode_meta(greedy, name) == Outcome::kShort);

  std::array<Vec3f, kBodySegments> places{};
  bool reported = false;
  greedy.resize(8, std::byte{0xFF});
  CHECK(decode_scale(greedy, places, reported) == Outcome::kShort);
  const MvnBytes points(4 + 4, std::byte{});  // no segments, no points
  CHECK(decode_scale(points, places, reported) == Outcome::kOk);
  CHECK_FALSE(reported);
  MvnBytes scale = encode_scale(places);
  CHECK(decode_scale(scale, places, reported) == Outcome::kOk);
  CHECK(reported);
  put_float(scale, 4 + 4 + 6, std::nanf(""));  // the pelvis
  CHECK(decode_scale(scale, places, reported) == Outcome::kOutOfRange);
}

}  // namespace posed::drivers::mvn

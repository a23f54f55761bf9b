// The VMC driver: from datagrams to frames and samples. Which datagrams make a frame is the matter
// of vmc_senders_test.cpp.
#include <catch2/catch.hpp>

#include <cmath>
#include <fstream>
#include <limits>
#include <random>

#include "proto/frame/rotation.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/recorded_log.hpp"
#include "tests/unit/drivers/refused.hpp"
#include "tests/unit/drivers/vmc_rig.hpp"

namespace posed::drivers {
namespace {

using test::bundle_of;
using test::Bytes;
using test::raw_bone;
using test::raw_message;
using test::vmc_message;
using test::VmcSession;
using vmc::DatagramWriter;
using vmc::Packing;
using vmc::ValueKind;
using vmc::VmcEmulator;

constexpr std::int64_t kVmcFrame_ns = 16'666'667;

std::size_t bone_index(std::string_view name) {
  const std::size_t found = vmc::find_bone(name);
  REQUIRE(found < vmc::kBoneCount);
  return found;
}

Quatf vmc_turned(Axis axis, double angle_rad) { return from_eigen(axis_rotation(axis, angle_rad)); }

double turned_by_rad(const Quatf& a, const Quatf& b) {
  return angle_between_rad(to_eigen_double(a), to_eigen_double(b));
}

// A sender of hips, spine and head in one bundle a frame, with whatever a test adds.
struct SmallPerformer {
  VmcSession session;
  int frames = 0;

  SmallPerformer() {
    for (int i = 0; i < 4; ++i) frame({});
    REQUIRE(session.layouts.size() == 1);
    session.sink.clear();
  }
  [[nodiscard]] float time_s() const { return static_cast<float>(frames) / 60.0F; }
  void frame(std::vector<Bytes> more, bool hips = true) {
    std::vector<Bytes> elements;
    if (hips)
      elements.push_back(message([](auto& w) { w.bone(vmc::kHips, {0, 1, 0}, kIdentity); }));
    elements.push_back(
        message([](auto& w) { w.bone(bone_index("Spine"), {0, 0.1F, 0}, kIdentity); }));
    elements.push_back(
        message([](auto& w) { w.bone(bone_index("Head"), {0, 0.5F, 0}, kIdentity); }));
    for (Bytes& bytes : more) elements.push_back(std::move(bytes));
    elements.push_back(message([this](auto& w) { w.time(time_s()); }));
    session.feed(bundle_of(elements), ++frames * kVmcFrame_ns);
  }
  template <typename Write>
  static Bytes message(Write&& write) {
    return vmc_message(std::forward<Write>(write));
  }
  [[nodiscard]] const Frame& last() const { return session.sink.frames.back(); }
};

// Any pose of all joints.
Frame random_pose(const Skeleton& skeleton, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Frame frame;
  frame.joint_count = static_cast<std::uint16_t>(skeleton.joints.size());
  for (std::size_t j = 0; j < frame.joint_count; ++j) {
    const Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
    frame.rotation_xyzw[j] = from_eigen(q.normalized());
    frame.valid.set(j);
  }
  frame.root_position_m = {static_cast<float>(normal(random)), 0.9F,
                           static_cast<float>(normal(random))};
  return frame;
}

}  // namespace

TEST_CASE("a VMC avatar arrives as it was posed, however its frames are packed") {
  for (const Packing packing : {Packing::kOneBundle, Packing::kBundles, Packing::kMessages}) {
    VmcEmulator emulator(60.0, packing);
    VmcSession session;
    std::mt19937 random(3);
    for (int i = 0; i < 100; ++i) {
      const Frame pose = random_pose(*emulator.skeleton(0), random);
      emulator.pose(0, pose);
      const std::int64_t due_ns = emulator.next_due_ns();
      const std::size_t before = session.sink.frames.size();
      session.feed(test::vmc_burst(emulator), due_ns);
      if (session.layouts.empty()) continue;
      if (before == 0 && session.sink.frames.empty()) continue;  // described by this frame
      REQUIRE(session.sink.frames.size() == before + 1);
      const Frame& got = session.sink.frames.back();
      REQUIRE(got.joint_count == vmc::kBoneCount);
      CHECK(got.valid.count() == vmc::kBoneCount);
      CHECK(got.header.device_ns == Approx(static_cast<double>(due_ns)).margin(200));
      for (std::size_t j = 0; j < got.joint_count; ++j) {
        CHECK(turned_by_rad(got.rotation_xyzw[j], pose.rotation_xyzw[j]) < 1e-5);
      }
      for (std::size_t k = 0; k < 3; ++k) {
        CHECK(got.root_position_m[k] == Approx(pose.root_position_m[k]).margin(1e-6));
      }
    }
    CHECK(session.layouts.size() == 1);
    CHECK(session.sink.frames.size() >= 96);
    CHECK(session.sink.samples.size() == session.sink.frames.size());
    CHECK(session.body().skeleton->id == emulator.skeleton(0)->id);
  }
}

TEST_CASE("a VMC avatar's skeleton has the bones and positions that were sent") {
  VmcEmulator emulator(60.0, Packing::kOneBundle);
  emulator.leave_out(bone_index("UpperChest"));
  emulator.leave_out(bone_index("Jaw"));
  VmcSession session;
  for (int i = 0; i < 4; ++i) session.feed(test::vmc_burst(emulator), i * kVmcFrame_ns);
  const Skeleton& skeleton = *session.body().skeleton;
  CHECK(session.body().name == "performer");
  REQUIRE(skeleton.joints.size() == 53);
  CHECK(skeleton.joint_index("Jaw") == -1);
  const Joint& neck = skeleton.joints[skeleton.joint_of(Bone::kNeck)];
  CHECK(neck.name == "Neck");
  CHECK(neck.parent == skeleton.joint_of(Bone::kChest));
  CHECK(skeleton.joints[skeleton.joint_index("LeftEye")].parent == skeleton.joint_of(Bone::kHead));
  CHECK_FALSE(skeleton.joints[skeleton.joint_index("LeftEye")].bone);
  // The left hand is at +X, and its thumb's first bone is what posed calls the metacarpal.
  CHECK(skeleton.joints[skeleton.joint_of(Bone::kLeftLowerArm)].offset_m.x() == Approx(0.24));
  CHECK(skeleton.joints[skeleton.joint_of(Bone::kRightLowerArm)].offset_m.x() == Approx(-0.24));
  CHECK(skeleton.joints[skeleton.joint_of(Bone::kLeftThumbMetacarpal)].name == "LeftThumbProximal");
  CHECK(skeleton.joints[0].offset_m.y() == Approx(0.86));
  for (const Joint& joint : skeleton.joints) CHECK(joint.T_world_joint.w() == 1.0);
}

TEST_CASE("VMC's left-handed axes become posed's") {
  SmallPerformer small;
  // In Unity, about +Y by 90 degrees turns +Z to +X: from facing the viewer to the person's right.
  const float half = std::sqrt(0.5F);
  small.frame({raw_bone("Neck", {0, 0, 0, 0, half, 0, half}),
               raw_message("/VMC/Ext/Root/Pos", "sfffffff", "root", {2, 0, 5, 0, half, 0, half})});
  const Frame& frame = small.last();
  // The hips are 1 m above the root, turned with it.
  CHECK(frame.root_position_m[0] == Approx(-2));
  CHECK(frame.root_position_m[1] == Approx(1));
  CHECK(frame.root_position_m[2] == Approx(5));
  const Eigen::Vector3d facing = to_eigen_double(frame.rotation_xyzw[0]) * Eigen::Vector3d::UnitZ();
  CHECK((facing - Eigen::Vector3d(-1, 0, 0)).norm() < 1e-6);  // posed's right hand is at -X
}

TEST_CASE("the hips stand in the room of the root, which may come later than they do") {
  SmallPerformer small;
  const Quatf quarter = vmc_turned(Axis::kY, 0.5);
  for (int i = 0; i < 2; ++i) {
    small.frame({SmallPerformer::message([&](auto& w) { w.root({1, 0, 2}, quarter); })});
  }
  const Frame& frame = small.last();
  CHECK(turned_by_rad(frame.rotation_xyzw[0], quarter) < 1e-5);
  CHECK(frame.root_position_m[0] == Approx(1));
  CHECK(frame.root_position_m[1] == Approx(1));
  CHECK(frame.root_position_m[2] == Approx(2));
}

TEST_CASE("wrong VMC messages are counted, and what is beside them is kept") {
  SmallPerformer small;
  const auto bad_count = [&small](Bytes message) {
    const int before = small.session.sink.count(Outcome::kOutOfRange);
    const std::size_t frames = small.session.sink.frames.size();
    small.frame({std::move(message)});
    CHECK(small.session.sink.frames.size() == frames + 1);
    return small.session.sink.count(Outcome::kOutOfRange) - before;
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  CHECK(bad_count(raw_bone("Neck", {0, 0, 0, 0, 0, 0, 1})) == 0);
  CHECK(bad_count(raw_bone("Neck", {0, 0, 0, 0, 0, 0, 1, 7, 7})) == 0);  // surplus arguments
  CHECK(bad_count(raw_bone("Neck", {0, 0, 0, 0, 0, 0})) == 1);
  CHECK(bad_count(raw_bone("Neck", {})) == 1);
  CHECK(bad_count(raw_bone("Neck", {kNan, 0, 0, 0, 0, 0, 1})) == 1);
  CHECK(bad_count(raw_bone("Neck", {2000, 0, 0, 0, 0, 0, 1})) == 1);
  CHECK(bad_count(raw_bone("Neck", {0, 0, 0, 0, kNan, 0, 1})) == 1);
  CHECK(bad_count(raw_bone("Neck", {0, 0, 0, 0, 0.5F, 0, 0.5F})) == 1);
  CHECK(bad_count(raw_bone("Neck", {0, 0, 0, 0, 0, 0, 0.999F})) == 0);
  CHECK(bad_count(raw_bone("Tail", {0, 0, 0, 0, 0, 0, 1})) == 1);
  CHECK(bad_count(raw_bone("LastBone", {0, 0, 0, 0, 0, 0, 1})) == 0);
  CHECK(bad_count(raw_bone("Hips", {0, 0, 0, 0, 0, 0, 1})) == 1);  // twice in a bundle
  CHECK(bad_count(raw_message("/VMC/Ext/Bone/Pos", "sfffifff", "Neck", {0, 0, 0, 0, 0, 0, 1})) ==
        0);  // any number
  CHECK(bad_count(raw_message("/VMC/Ext/Root/Pos", "sff", "root", {0, 0})) == 1);
  CHECK(bad_count(raw_message("/VMC/Ext/Blend/Val", "sf", "Joy", {kNan})) == 1);
  CHECK(bad_count(raw_message("/VMC/Ext/Blend/Val", "s", "Joy", {})) == 1);
  CHECK(bad_count(raw_message("/VMC/Ext/OK", "f", "", {1})) == 0);
  CHECK(bad_count(raw_message("/VMC/Ext/OK", "iif", "", {1, 1, 1})) ==
        0);  // only the first is needed
  CHECK(bad_count(raw_message("/VMC/Ext/OK", "iiif", "", {1, 1, 1, 1})) == 0);
  CHECK(bad_count(raw_message("/VMC/Ext/VRM", "s", "path", {})) == 1);
  CHECK(bad_count(raw_message("/VMC/Ext/Tra/Pos", "sfff", "A", {1, 2, 3})) == 1);
  CHECK(bad_count(raw_message("/VMC/Ext/Cam", "sf", "Camera", {1})) == 0);  // not used
  CHECK(bad_count(raw_message("/VMC/Thru/any/thing", "f", "", {1})) == 0);
  CHECK(bad_count(raw_message("/other", "f", "", {1})) == 0);
  const int foreign = small.session.sink.count(Outcome::kForeign);
  small.session.feed(raw_message("/other", "f", "", {1}), 1);
  small.session.feed(Bytes(20, std::byte{7}), 1);
  // Another program's, with a type of a later OSC.
  small.session.feed(bundle_of({raw_message("/other", "x", "", {})}), 1);
  CHECK(small.session.sink.count(Outcome::kForeign) == foreign + 3);
  for (const Frame& frame : small.session.sink.frames) CHECK(test::is_valid(frame));
}

TEST_CASE("a VMC bone that was lost is not valid; one that is left out keeps its rotation") {
  SmallPerformer small;
  small.frame({}, false);
  CHECK_FALSE(small.last().valid[0]);
  CHECK(small.last().valid[1]);
  CHECK(small.last().root_position_m[1] == Approx(1));  // where the hips were
  small.session.feed(bundle_of({raw_bone("Hips", {0, 2, 0, 0, 0, 0, 0}),
                                SmallPerformer::message([&](auto& w) { w.time(small.time_s()); })}),
                     small.frames * kVmcFrame_ns);
  CHECK_FALSE(small.last().valid[0]);
  CHECK_FALSE(small.last().valid[1]);
  CHECK(small.last().rotation_xyzw[0] == kIdentity);
  CHECK(small.last().root_position_m[1] == Approx(2));
  // A finger of 90 degrees, sent in every 15th frame.
  const float half = std::sqrt(0.5F);
  for (int i = 0; i < 120; ++i) {
    std::vector<Bytes> finger;
    if (i < 61 && i % 15 == 0) {
      finger.push_back(raw_bone("LeftIndexProximal", {0, 0, 0, 0, 0, half, half}));
    }
    small.frame(std::move(finger));
    if (i < 50) continue;  // it is described
    const int joint = small.session.body().skeleton->joint_of(Bone::kLeftIndexProximal);
    REQUIRE(joint >= 0);
    CHECK(small.last().valid[joint]);
    CHECK(small.last().rotation_xyzw[joint][3] == Approx(half));
  }
  for (int i = 0; i < 30; ++i) small.frame({});
  CHECK(small.session.body().skeleton->joint_of(Bone::kLeftIndexProximal) < 0);
}

TEST_CASE("blend shapes and trackers of a VMC performer become samples") {
  VmcEmulator emulator(60.0, Packing::kBundles);
  VmcSession session;
  for (int i = 0; i < 5; ++i) session.feed(test::vmc_burst(emulator), i * kVmcFrame_ns);
  const SampleLayout& layout = session.body().samples;
  REQUIRE(layout.names.size() == 16);
  CHECK(layout.names[0] == "hmd/HMD/x");
  CHECK(layout.names[13] == "tra/LHR-0001/qw");
  CHECK(layout.names[14] == "Joy");
  CHECK(layout.units[0] == "m");
  CHECK(layout.units[3] == "1");
  const Sample& sample = session.sink.samples.back();
  CHECK(sample.value_count == 16);
  CHECK(sample.valid.count() == 16);
  const Vec3f& hips_m = session.sink.frames.back().root_position_m;
  for (std::size_t k = 0; k < 3; ++k) CHECK(sample.value[7 + k] == Approx(hips_m[k]));
  CHECK(sample.value[14] + sample.value[15] == Approx(1.0));
}

TEST_CASE("a face alone is a VMC performer without a skeleton") {
  VmcSession session;
  for (int i = 0; i < 5; ++i) {
    session.feed(bundle_of({raw_message("/VMC/Ext/Blend/Val", "sf", "\xe3\x81\x82", {0.1F}),
                            raw_message("/VMC/Ext/Blend/Val", "sf", "a\xff", {0.2F}),
                            raw_message("/VMC/Ext/Blend/Apply", "", "", {})}),
                 i * kVmcFrame_ns);
  }
  REQUIRE(session.layouts.size() == 1);
  CHECK(session.body().skeleton == nullptr);
  CHECK(session.body().samples.names == std::vector<std::string>{"\xe3\x81\x82", "a\\xff"});
  CHECK(session.sink.frames.empty());
  REQUIRE(session.sink.samples.size() == 2);
  CHECK(session.sink.samples[1].value[1] == 0.2F);
  CHECK(session.sink.samples[1].header.device_ns == kNoTime_ns);
}

TEST_CASE("more VMC values than posed takes are left out") {
  SmallPerformer small;
  std::vector<Bytes> more;
  for (int i = 0; i < 200; ++i) {
    more.push_back(raw_message("/VMC/Ext/Blend/Val", "sf", "shape" + std::to_string(i), {0.5F}));
  }
  more.push_back(raw_message("/VMC/Ext/Tra/Pos", "sfffffff", "A", {1, 2, 3, 0, 0, 0, 1}));
  for (int i = 0; i < 60; ++i) small.frame(more);
  CHECK(small.session.body().samples.names.size() == vmc::kMaxVmcValues);
  CHECK(small.session.sink.samples.back().valid.count() == vmc::kMaxVmcValues);
}

TEST_CASE("a VMC frame that another overtook is late") {
  SmallPerformer small;
  const std::size_t frames = small.session.sink.frames.size();
  small.frames -= 2;
  small.frame({});  // overtaken by two others
  CHECK(small.session.sink.count(Outcome::kLate) == 1);
  CHECK(small.session.sink.frames.size() == frames);
}

TEST_CASE("wrong options of the VMC driver are refused at once") {
  const Driver& driver = *find_driver("vmc");
  test::check_refused(driver, {{{{"listen", std::string("nonsense")}}, "an address and a port"},
                               {{{"listen", std::string("0.0.0.0:39539")}}, "peers"},
                               {{{"packing", std::string("box")}}, "packing"},
                               {{{"rate_hz", 0.0}}, "rate_hz"}});
  test::check_undescribed(driver, {"", "vmc", "vmc rate=", "vmc rate=nan", "vmc rate=0"});
}

namespace {

// Frames in several bundles; damage, a bundle that is lost and one that is late, and a model that
// is unloaded.
std::string emulated_vmc_log() {
  std::string text =
      "# Not a recording: made by posed's emulator of a VMC performer, with damage put in.\n"
      "driver vmc\nidentity udp 127.0.0.1:39539\ntext vmc rate=60\n";
  VmcEmulator emulator(60.0, Packing::kBundles);
  for (std::size_t bone = 9; bone < 55; ++bone) {
    if (vmc::bone_table()[bone].name.find("UpperLeg") == std::string_view::npos) {
      emulator.leave_out(bone);
    }
  }
  VmcSession session;
  Bytes late;
  for (int i = 0; i < 90; ++i) {
    if (i == 16) emulator.set_status({.loaded = false});
    const std::int64_t now_ns = emulator.next_due_ns();
    std::vector<Bytes> burst = test::vmc_burst(emulator);
    if (i > 18 && i % 16 != 0) continue;                // to keep the log short
    if (i == 8) burst.front()[125] ^= std::byte{0x10};  // another name than Hips
    if (i == 10) burst.front().resize(burst.front().size() / 2);
    if (i == 12) late = burst.back();
    if (i == 12) burst.pop_back();
    if (i == 13) burst.push_back(late);
    for (const Bytes& datagram : burst) {
      text += test::recorded_row(now_ns, "hex", datagram);
      const int before = session.sink.descriptions;
      session.feed(datagram, now_ns);
      if (session.sink.descriptions != before)
        text += test::recorded_row(now_ns, "bodies", session.sink.described);
    }
  }
  return text;
}

}  // namespace

TEST_CASE("write the log of the emulated VMC performer", "[.write-logs]") {
  const auto path = test::golden("devices") / "vmc.log";
  if (!std::filesystem::exists(path)) std::ofstream(path) << emulated_vmc_log();
}

}  // namespace posed::drivers

// The VMC output from frames to datagrams on real sockets, on a virtual clock.

#include <string>

#include <catch2/catch.hpp>

#include "drivers/vmc/osc.hpp"
#include "models/motion/canonical_skeleton.hpp"
#include "models/motion/retarget.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/daemon/output/output_rig.hpp"
#include "tests/unit/drivers/vmc_rig.hpp"

namespace posed::output {
namespace {

constexpr std::int64_t kSixtieth_ns = kNanosPerSecond / 60;

// "root Hips ... OK T" of one burst of datagrams.
std::string contents(const std::vector<std::vector<std::byte>>& datagrams) {
  std::string text;
  for (const auto& datagram : datagrams) {
    drivers::vmc::each_message(datagram, [&](const drivers::vmc::OscMessage& message) {
      drivers::vmc::OscArguments arguments(message);
      const bool named = message.types.starts_with('s');
      text += named ? std::string(arguments.text())
                    : std::string(message.address.substr(message.address.rfind('/') + 1));
      text += ' ';
    });
  }
  return text;
}

// The numbers of each status: "1300 ".
std::string statuses(const std::vector<std::vector<std::byte>>& datagrams) {
  std::string text;
  for (const auto& datagram : datagrams) {
    drivers::vmc::each_message(datagram, [&](const drivers::vmc::OscMessage& message) {
      if (message.address != "/VMC/Ext/OK") return;
      drivers::vmc::OscArguments arguments(message);
      for (int i = 0; i < 4; ++i) text += std::to_string(static_cast<int>(arguments.number()));
      text += ' ';
    });
  }
  return text;
}

config::OutputConfig vmc_config(const std::vector<const UdpReceiver*>& receivers,
                                const std::string& body = "ann") {
  config::OutputConfig config;
  config.body = body;
  for (const UdpReceiver* receiver : receivers) config.to.push_back(receiver->endpoint());
  return config;
}

// Sends the clip to posed's own receiver and compares every bone.
void check_round_trip(const clip::Clip& walk, int frames) {
  UdpReceiver receiver;
  OutputRig rig(vmc_config({&receiver}));
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  const auto canonical = motion::canonical_skeleton(*walk.skeleton).value();
  const auto retarget = motion::Retarget::bind(walk.skeleton, canonical).value();
  test::VmcSession session;
  std::size_t compared = 0;
  double worst_rad = 0.0, worst_m = 0.0;
  for (int i = 0; i < frames; ++i) {
    const std::int64_t now_ns = (i + 1) * kSixtieth_ns;
    Frame expected;
    retarget.apply(walk.frame(i), expected);
    rig.pass(frame_of(0, walk.frame(i)), now_ns);
    const std::size_t before = session.sink.frames.size();
    const auto datagrams = receiver.received(rig.sent());
    REQUIRE(datagrams.size() > 0);
    for (const auto& datagram : datagrams) CHECK(datagram.size() <= 1472);
    session.feed(datagrams, now_ns);
    if (session.sink.frames.size() == before) continue;  // it was described only now
    const Frame& got = session.sink.frames.back();
    const Skeleton& skeleton = *session.body().skeleton;
    for (std::size_t j = 0; j < canonical->joints.size(); ++j) {
      const int there = skeleton.joint_of(*canonical->joints[j].bone);
      REQUIRE(there >= 0);
      const double turn_rad =
          angle_between_rad(to_eigen_double(got.rotation_xyzw[static_cast<std::size_t>(there)]),
                            to_eigen_double(expected.rotation_xyzw[j]));
      worst_rad = std::max(worst_rad, turn_rad);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      worst_m = std::max(worst_m, std::abs(static_cast<double>(got.root_position_m[k]) -
                                           static_cast<double>(expected.root_position_m[k])));
    }
    ++compared;
  }
  CHECK(compared > static_cast<std::size_t>(frames) - 6);
  CHECK(worst_rad < 1e-5);
  CHECK(worst_m < 1e-5);
  CHECK(session.layouts.size() == 1);
  CHECK(rig.reported.empty());
  CHECK(rig.stats().frames() == static_cast<std::uint64_t>(frames));
  CHECK(rig.stats().dropped() == 0);
}

}  // namespace

TEST_CASE("a walk arrives through the VMC output as it was") {
  check_round_trip(motion::make_walker({.seconds = 3.0, .rate_hz = 60.0}).value(), 180);
}

TEST_CASE("a recorded walk arrives through the VMC output as it was") {
  const auto path = test::shared("data/cmu/07_01.amc");
  if (!path) SKIP_WITHOUT_SHARED();
  const clip::Clip walk = clip::read_clip(*path).value();
  check_round_trip(walk, walk.frames());
}

TEST_CASE("the VMC output sends bundles of the protocol's bytes") {
  UdpReceiver receiver;
  OutputRig rig(vmc_config({&receiver}));
  Skeleton one;
  one.name = "one";
  one.joints.resize(2);
  one.joints[0].name = "hips";
  one.joints[0].bone = Bone::kHips;
  one.joints[1].name = "leftHand";
  one.joints[1].bone = Bone::kLeftHand;
  one.joints[1].parent = 0;
  one.joints[1].offset_m = {-0.25, 0, 0};
  REQUIRE(one.finish());
  rig.output->stream_comes(info_of(7, "ann", std::make_shared<const Skeleton>(one)));
  Frame frame;
  frame.header.stream = 7;
  frame.joint_count = 2;
  frame.rotation_xyzw.fill(kIdentity);
  frame.valid.set();
  rig.pass(frame, 0);
  const auto datagrams = receiver.received(rig.sent());
  REQUIRE(datagrams.size() == 1);
  const std::string text(reinterpret_cast<const char*>(datagrams[0].data()), datagrams[0].size());
  CHECK(text.starts_with(std::string("#bundle\0\0\0\0\0\0\0\0\1", 16)));
  const auto bytes_of_hex = [](const std::string& hex) {
    std::string bytes;
    for (std::size_t i = 0; i < hex.size(); i += 2) {
      bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
    }
    return bytes;
  };
  // A bone at Unity's (0.25, 0, 0), and the status in its oldest form, each behind its size; worked
  // out by hand.
  const std::string bone = bytes_of_hex(
      "00000048"
      "2f564d432f4578742f426f6e652f506f73000000"
      "2c7366666666666666000000"
      "4c65667448616e6400000000"
      "3e8000000000000000000000"
      "0000000000000000000000003f800000");
  const std::string status = bytes_of_hex(
      "00000014"
      "2f564d432f4578742f4f4b00"
      "2c69000000000001");
  REQUIRE(bone.size() == 4 + 72);
  const std::string apply = bytes_of_hex(
      "0000001c"
      "2f564d432f4578742f426c656e642f4170706c7900000000"
      "2c000000");
  CHECK(text.find(bone + apply + status) != std::string::npos);
  CHECK(contents(datagrams) == "root Hips LeftHand Apply OK T ");
}

TEST_CASE("the VMC output keeps its rate and says when a pose is old") {
  UdpReceiver receiver;
  config::OutputConfig config = vmc_config({&receiver});
  config.rate_hz = 60.0;
  OutputRig rig(config);
  const clip::Clip walk = motion::make_walker({.seconds = 1.0, .rate_hz = 120.0}).value();
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  int frames = 0;
  for (int i = 0; i < 120; ++i) {
    rig.pass(frame_of(0, walk.frame(i)), i * kSixtieth_ns / 2);
    if (!receiver.received(rig.sent()).empty()) ++frames;
  }
  CHECK(frames == 60);
  CHECK(rig.stats().frames() == 120);
  CHECK(rig.stats().dropped() == 0);
  Frame stale = frame_of(0, walk.frame(119));
  stale.quality = Quality::kStale;
  rig.pass(stale, 3 * kNanosPerSecond);
  CHECK(statuses(receiver.received(rig.sent())) == "1300 ");  // not tracking
}

TEST_CASE("of the frames that come together, the VMC output with a rate sends the newest") {
  UdpReceiver receiver;
  config::OutputConfig config = vmc_config({&receiver});
  config.rate_hz = 60.0;
  OutputRig rig(config);
  const clip::Clip walk = motion::make_walker({.seconds = 1.0, .rate_hz = 60.0}).value();
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  for (const Quality quality : {Quality::kMeasured, Quality::kMeasured, Quality::kStale}) {
    Frame frame = frame_of(0, walk.frame(0));
    frame.quality = quality;
    rig.output->frame(frame);
  }
  static_cast<void>(rig.output->turn(0));
  CHECK(statuses(receiver.received(rig.sent())) ==
        "1300 ");  // of the last frame alone, an old pose
}

TEST_CASE("an assistant sends hands only, driven by whichever hand is there") {
  UdpReceiver receiver;
  config::OutputConfig config = vmc_config({&receiver}, "");
  config.left_hand = "left";
  config.right_hand = "right";
  config.assistant = true;
  OutputRig rig(config);
  const auto left = std::make_shared<const Skeleton>(hand_skeleton(Side::kLeft));
  const auto right = std::make_shared<const Skeleton>(hand_skeleton(Side::kRight));
  Frame left_pose, right_pose;
  set_hand_angles(*left, {}, left_pose);
  set_hand_angles(*right, {}, right_pose);
  rig.output->stream_comes(info_of(1, "left", left));
  rig.output->stream_comes(info_of(2, "right", right));
  rig.pass(frame_of(2, right_pose), 0);
  const std::string right_only = contents(receiver.received(rig.sent()));
  CHECK(right_only.starts_with("RightThumbProximal "));
  CHECK(right_only.ends_with("RightLittleDistal OK T "));
  CHECK(right_only.find("Left") == std::string::npos);
  CHECK(right_only.find("root") == std::string::npos);
  rig.pass(frame_of(1, left_pose), kSixtieth_ns);
  const std::string both = contents(receiver.received(rig.sent()));
  CHECK(both.find("LeftThumbProximal ") == 0);
  CHECK(both.find("RightThumbProximal ") != std::string::npos);
  rig.pass(frame_of(2, right_pose), kSixtieth_ns + 1);
  CHECK(receiver.received(rig.sent()).empty());  // the left hand's frames carry the right one
  rig.pass(frame_of(2, right_pose), kNanosPerSecond);
  CHECK_FALSE(receiver.received(rig.sent()).empty());  // it is silent
}

TEST_CASE("a dead receiver is counted and told once, and the other one hears everything") {
  UdpReceiver receiver;
  config::OutputConfig config = vmc_config({&receiver});
  std::string endpoint;
  {
    const UdpReceiver dead;
    endpoint = dead.endpoint();
  }  // nobody listens there any more
  config.to.insert(config.to.begin(), endpoint);
  OutputRig rig(config);
  const clip::Clip walk = motion::make_walker({.seconds = 1.0, .rate_hz = 60.0}).value();
  rig.output->stream_comes(info_of(5, "ann", walk.skeleton));
  for (int i = 0; i < 60; ++i) rig.pass(frame_of(5, walk.frame(i)), i * kSixtieth_ns);
  // Datagrams so far, for each of the two: those to the dead one have failed, but for one whose
  // refusal is told with the next.
  const auto datagrams = [&] { return (rig.stats().sent() + rig.stats().failures()) / 2; };
  const std::uint64_t before = datagrams();
  CHECK(before >= 120);
  CHECK((rig.stats().sent() + rig.stats().failures()) % 2 == 0);
  CHECK(rig.stats().sent() < before * 5 / 4);
  CHECK(receiver.received(before).size() == before);
  CHECK(rig.stats().receivers() == 2);
  CHECK(rig.stats().address() == endpoint + ", " + receiver.endpoint());
  CHECK(rig.stats().failures() > before * 3 / 4);
  CHECK(rig.stats().failures() < before);
  REQUIRE(rig.reported.size() == 1);
  CHECK(rig.reported[0] ==
        "5: output test: sending to " + endpoint +
            " fails: nobody listens there; start the receiver, or correct its port");

  UdpReceiver again(endpoint);  // it starts
  for (int i = 0; i < 360; ++i) {
    rig.pass(frame_of(5, walk.frame(i % 60)), kNanosPerSecond + i * kSixtieth_ns);
  }
  // Also the datagram at which the last refusal was reported has come.
  const std::uint64_t since = datagrams() - before;
  CHECK(again.received(since).size() == since);
  CHECK(receiver.received(before + since).size() == since);
  REQUIRE(rig.reported.size() == 2);
  CHECK(rig.reported[1] == "5: output test: sending to " + endpoint + " works again (good)");
}

TEST_CASE("an output tells which stream cannot move its part, and goes on with the others") {
  UdpReceiver receiver;
  config::OutputConfig config = vmc_config({&receiver});
  config.left_hand = "glove";
  OutputRig rig(config);
  const clip::Clip walk = motion::make_walker({.seconds = 0.2, .rate_hz = 60.0}).value();
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  const auto right = std::make_shared<const Skeleton>(hand_skeleton(Side::kRight));
  rig.output->stream_comes(info_of(1, "glove", right));
  Frame hand;
  set_hand_angles(*right, {}, hand);
  rig.pass(frame_of(1, hand), 0);
  rig.pass(frame_of(0, walk.frame(0)), 1);
  rig.pass(frame_of(0, walk.frame(1)), kSixtieth_ns);
  REQUIRE(rig.reported.size() == 1);
  CHECK(rig.reported[0].find("0: output test: stream 'glove' cannot move its left hand: ") == 0);
  CHECK(contents(receiver.received(rig.sent())).find("Hips ") != std::string::npos);
}

TEST_CASE("an output's face keeps its values and gets the names that are wanted") {
  UdpReceiver receiver;
  config::OutputConfig config = vmc_config({&receiver});
  config.vrm1_names = true;
  OutputRig rig(config);
  const clip::Clip walk = motion::make_walker({.seconds = 0.2, .rate_hz = 60.0}).value();
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton, {.names = {"Joy"}, .units = {"1"}}));
  Sample sample;
  sample.value_count = 1;
  sample.value[0] = 0.5F;
  sample.valid.set(0);
  rig.output->sample(sample);
  for (int i = 0; i < 2; ++i) {
    rig.pass(frame_of(0, walk.frame(i)), i * kSixtieth_ns);
    CHECK(contents(receiver.received(rig.sent())).find(" happy Apply OK T ") != std::string::npos);
  }
}

}  // namespace posed::output

// The BVH output from frames to lines on real sockets, on a virtual clock.
#include "daemon/output/axis_output.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "drivers/axis/decoder.hpp"
#include "models/motion/canonical_skeleton.hpp"
#include "models/motion/retarget.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/format.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/raw_peer.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/daemon/output/output_rig.hpp"
#include "tests/unit/drivers/axis_rig.hpp"

namespace posed::output {
namespace {

constexpr std::int64_t kBvhFrame_ns = kNanosPerSecond / 60;

config::OutputConfig bvh_config() {
  config::OutputConfig config;
  config.kind = config::OutputKind::kBvh;
  config.body = "ann";
  config.listen = "127.0.0.1:0";
  return config;
}

struct BvhRig : OutputRig {
  explicit BvhRig(const config::OutputConfig& config) : OutputRig(config) {
    output->stream_comes(info_of(0, "ann", walk.skeleton));
  }
  [[nodiscard]] test::RawPeer connect() {
    test::RawPeer peer(static_cast<const AxisOutput&>(*output).endpoint());
    now_ns += LineClients::kLook_ns;  // it is let in at the next look
    static_cast<void>(output->turn(now_ns));
    return peer;
  }
  void step(int frame) {
    now_ns += kBvhFrame_ns;
    pass(frame_of(0, walk.frame(frame % walk.frames())), now_ns);
  }

  clip::Clip walk = motion::make_walker({.seconds = 1.0, .rate_hz = 60.0}).value();
  std::int64_t now_ns = 0;
};

std::size_t count_of(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    ++count;
  }
  return count;
}

// What has come, up to the end of a line.
std::string next_lines(const test::RawPeer& peer) {
  std::string lines;
  for (int i = 0; i < 500 && !lines.ends_with("||\n"); ++i) {
    lines += peer.receive(1 << 20, std::chrono::milliseconds(1));
  }
  return lines;
}

// Sends the clip to posed's own reader of Axis streams and compares every bone that both have.
void check_lines(const clip::Clip& walk, int frames) {
  BvhRig rig(bvh_config());
  rig.walk = walk;
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  const test::RawPeer peer = rig.connect();
  const auto canonical = motion::canonical_skeleton(*walk.skeleton).value();
  const auto to_canonical = motion::Retarget::bind(walk.skeleton, canonical).value();
  std::optional<motion::Retarget> back;
  test::AxisRig axis;
  double worst_rad = 0.0, worst_m = 0.0;
  int compared = 0;
  for (int i = 0; i < frames; ++i) {
    rig.step(i);
    const std::string line = next_lines(peer);
    REQUIRE(count_of(line, "||") == 1);
    CHECK(line.starts_with("0 ann "));
    axis.now_ns = rig.now_ns;
    axis.sink.clear();
    axis.feed(test::axis_text_bytes(line));
    if (axis.sink.frames.empty()) continue;  // it was described only now
    if (!back) {
      back = motion::Retarget::bind(axis.layouts.back()->bodies[0].skeleton, canonical).value();
    }
    Frame expected, got;
    to_canonical.apply(walk.frame(i), expected);
    back->apply(axis.sink.frames[0], got);
    for (std::size_t j = 0; j < canonical->joints.size(); ++j) {
      if (!got.valid[j]) continue;  // the figure has no such bone
      worst_rad =
          std::max(worst_rad, angle_between_rad(to_eigen_double(got.rotation_xyzw[j]),
                                                to_eigen_double(expected.rotation_xyzw[j])));
      ++compared;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      worst_m = std::max(worst_m, std::abs(static_cast<double>(got.root_position_m[k]) -
                                           static_cast<double>(expected.root_position_m[k])));
    }
  }
  CHECK(compared > 15 * (frames - 6));
  CHECK(worst_rad < 1e-5);
  CHECK(worst_m < 1e-3);
  CHECK(rig.reported.empty());
}

}  // namespace

TEST_CASE("a walk arrives through the BVH output at posed's reader of Axis streams as it was") {
  check_lines(motion::make_walker({.seconds = 1.0, .rate_hz = 60.0}).value(), 60);
}

TEST_CASE("a recorded walk arrives through the BVH output as it was") {
  const auto path = test::shared("data/cmu/07_01.amc");
  if (!path) SKIP_WITHOUT_SHARED();
  check_lines(clip::read_clip(*path).value(), 200);
}

TEST_CASE("a walk goes out in binary, over TCP and UDP, as the same values") {
  config::OutputConfig config = bvh_config();
  config.kind = config::OutputKind::kAxis;
  config.binary = true;
  BvhRig tcp(config);
  const test::RawPeer peer = tcp.connect();
  UdpReceiver receiver;
  config.to = {receiver.endpoint()};
  BvhRig udp(config);
  BvhRig text(bvh_config());
  const test::RawPeer reader = text.connect();
  for (int i = 0; i < 3; ++i) {
    for (BvhRig* rig : {&tcp, &udp, &text}) rig->step(i);
    const auto datagrams = receiver.received(static_cast<std::uint64_t>(i) + 1);
    REQUIRE(datagrams.size() == 1);
    drivers::axis::Message expected, got;
    const std::string line = next_lines(reader);
    REQUIRE(drivers::axis::decode_text(std::string_view(line).substr(0, line.size() - 3),
                                       expected) == Outcome::kOk);
    const std::string bytes = peer.receive(datagrams[0].size(), std::chrono::milliseconds(1000));
    REQUIRE(drivers::axis::decode_binary(std::as_bytes(std::span(bytes)), got) == Outcome::kOk);
    for (std::size_t v = 0; v < drivers::axis::value_count(got.content); ++v) {
      CHECK(got.values[v] == Approx(expected.values[v]).margin(1e-4));
    }
    CHECK(std::ranges::equal(datagrams[0], std::as_bytes(std::span(bytes))));
  }
}

TEST_CASE("several people go out as avatars of one Axis output, also at a limited rate") {
  UdpReceiver receiver;
  config::OutputConfig config;
  config.kind = config::OutputKind::kAxis;
  config.bodies = {"ann", "bob"};
  config.to = {receiver.endpoint()};
  config.rate_hz = 60.0;
  const OutputRig rig(config);
  const auto walk = motion::make_walker({.seconds = 1.0, .rate_hz = 60.0}).value();
  rig.output->stream_comes(info_of(4, "ann", walk.skeleton));
  rig.output->stream_comes(info_of(7, "bob", walk.skeleton));
  for (const std::uint32_t stream : {4U, 7U, 4U}) {  // the newest of each is sent
    rig.output->frame(frame_of(stream, walk.frame(0)));
  }
  static_cast<void>(rig.output->turn(0));
  const auto datagrams = receiver.received(2);
  REQUIRE(datagrams.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string_view line(reinterpret_cast<const char*>(datagrams[i].data()),
                                datagrams[i].size());
    CHECK(line.starts_with(i == 0 ? "0 ann " : "1 bob "));
  }
}

TEST_CASE("a client that wants it gets the BVH header, whose channels are the values of a line") {
  config::OutputConfig config = bvh_config();
  config.header = true;
  BvhRig rig(config);
  const test::RawPeer peer = rig.connect();
  rig.step(0);
  const std::string text = next_lines(peer);
  const std::size_t begin = text.find("0 ann ");
  REQUIRE(begin != std::string::npos);
  // The values between the name and the "||" are a motion line of that BVH.
  const std::string values = text.substr(begin + 6, text.size() - begin - 6 - 4);
  const auto clip =
      clip::parse_clip({.name = "stream.bvh",
                        .bytes = text.substr(0, begin) +
                                 "MOTION\nFrames: 1\nFrame Time: 0.0166667\n" + values + "\n"},
                       {.metres_per_unit = 0.01});
  if (!clip) FAIL(clip.error().text());
  CHECK(clip->skeleton->joints.size() == drivers::axis::kBones);
  CHECK(clip->channels.cols() == 6 * 59);
  CHECK(clip->channels(0, 1) == Approx(rig.walk.frame(0).root_position_m[1]).margin(1e-3));

  // Another person: the client would misread what follows, so it has to connect again.
  const auto smaller = motion::make_walker({.person = 9, .seconds = 0.2, .rate_hz = 60.0}).value();
  rig.output->stream_comes(info_of(3, "ann", smaller.skeleton));
  rig.pass(frame_of(3, smaller.frame(0)), rig.now_ns + 1);
  CHECK(peer.hung_up());
}

TEST_CASE("a client that does not read misses whole lines, is disconnected, and delays nobody") {
  BvhRig rig(bvh_config());
  const test::RawPeer stopped = rig.connect();
  const test::RawPeer reading = rig.connect();
  CHECK(rig.stats().receivers() == 2);
  std::size_t lines = 0, frames = 0;
  while (rig.stats().receivers() == 2 && frames < 20'000) {
    rig.step(static_cast<int>(frames++));
    lines += count_of(next_lines(reading), "||\n");
  }
  CHECK(lines == frames);
  CHECK(rig.stats().receivers() == 1);
  REQUIRE(rig.reported.size() == 1);
  CHECK(rig.reported[0].find("was disconnected: it took nothing for 2 s") != std::string::npos);
  CHECK(rig.stats().dropped() > 100);
  CHECK(rig.stats().failures() == 0);  // the system refused no send
  // What it finds in its buffers is whole lines, except for the last one.
  const std::string late = stopped.receive(16 << 20, std::chrono::milliseconds(2000));
  CHECK(count_of(late, "||\n") == count_of(late, "\n"));
  for (std::size_t at = 0; at < late.size();) {
    REQUIRE(late.substr(at).starts_with(std::string("0 ann ").substr(0, late.size() - at)));
    const std::size_t end = late.find('\n', at);
    if (end == std::string::npos) break;
    at = end + 1;
  }
}

TEST_CASE("a client that pauses finds whole lines before and after the gap") {
  BvhRig rig(bvh_config());
  const test::RawPeer pausing = rig.connect();
  int frames = 0;
  while (rig.stats().dropped() < 10 && frames < 20'000) rig.step(frames++);
  std::string text = next_lines(pausing);
  for (int i = 0; i < 10; ++i) {
    rig.step(frames++);
    text += next_lines(pausing);
  }
  CHECK(rig.stats().receivers() == 1);
  CHECK(count_of(text, "||\n") == rig.stats().sent());
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    const std::vector<std::string> all{std::istream_iterator<std::string>(words), {}};
    REQUIRE(all.size() == 2 + 354 + 1);  // number, name, values and "||"
  }
}

TEST_CASE("a line that a client takes in pieces goes out whole before the next one") {
  LineClients clients = LineClients::open("127.0.0.1:0", {}).value();
  const test::RawPeer peer(clients.endpoint());
  CHECK(clients.look(0).empty());
  CHECK(clients.size() == 1);
  const std::string line = std::string(2'000'000, 'a') + "\n";  // far more than all buffers hold
  CHECK(clients.send(line, 1).sent == 1);
  CHECK(clients.send("lost\n", 2).dropped == 1);
  std::string text;
  for (int i = 0; i < 2000 && text.size() < line.size(); ++i) {
    text += peer.receive(1 << 20, std::chrono::milliseconds(1));
    CHECK(clients.look(3).empty());
  }
  CHECK((text == line));
  CHECK(clients.send("next\n", 4).sent == 1);
  CHECK(peer.receive(5) == "next\n");
}

TEST_CASE("a client that takes anything is not taken for one that does not read") {
  LineClients clients = LineClients::open("127.0.0.1:0", {}).value();
  const test::RawPeer peer(clients.endpoint());
  CHECK(clients.look(0).empty());
  const std::string line = std::string(2'000'000, 'a') + "\n";  // far more than all buffers hold
  CHECK(clients.send(line, 1).sent == 1);
  CHECK(clients.send("lost\n", 2).dropped == 1);
  std::size_t got = 0;
  for (int i = 0; i < 2000 && got < line.size(); ++i) {
    got += peer.receive(1 << 20, std::chrono::milliseconds(1)).size();
    CHECK(clients.look(3).empty());
  }
  CHECK(got == line.size());
  // Nobody has sent it anything since, so its patience does not run.
  CHECK(clients.look(10 * kNanosPerSecond).empty());
  CHECK(clients.size() == 1);
}

TEST_CASE("a line to a client that has gone is a send that the system refuses") {
  LineClients clients = LineClients::open("127.0.0.1:0", {}).value();
  {
    const test::RawPeer peer(clients.endpoint());
    CHECK(clients.look(0).empty());
  }
  SendOutcome all;
  for (int i = 0; i < 1000 && clients.size() > 0; ++i) {
    const SendOutcome one = clients.send("line\n", i);
    all.sent += one.sent;
    all.dropped += one.dropped;
    all.failed += one.failed;
  }
  CHECK(clients.size() == 0);
  CHECK(all.sent > 0);  // the first ones, until its computer answers
  CHECK(all.dropped == 0);
  CHECK(all.failed == 1);
}

TEST_CASE("of the frames that come together, a limited rate sends the newest") {
  config::OutputConfig config = bvh_config();
  config.rate_hz = 60.0;
  BvhRig rig(config);
  const test::RawPeer peer = rig.connect();
  Frame frame = rig.walk.frame(0);
  for (int i = 1; i <= 3; ++i) {
    frame.root_position_m[0] = static_cast<float>(i);
    rig.output->frame(frame_of(0, frame));
  }
  static_cast<void>(rig.output->turn(rig.now_ns + kBvhFrame_ns));
  const std::string line = next_lines(peer);
  CHECK(count_of(line, "||\n") == 1);
  CHECK(line.starts_with("0 ann 300.0"));  // cm
}

TEST_CASE("there are at most 16 clients; one that goes makes room") {
  BvhRig rig(bvh_config());
  std::vector<test::RawPeer> peers;
  for (std::size_t i = 0; i < LineClients::kMaxClients; ++i) peers.push_back(rig.connect());
  CHECK(rig.stats().receivers() == 16);
  CHECK(rig.reported.empty());
  CHECK(rig.connect().hung_up());
  CHECK(rig.stats().failures() == 0);
  REQUIRE(rig.reported.size() == 1);
  CHECK(rig.reported[0].find("127.0.0.1 was refused: there are 16 clients") != std::string::npos);
  peers.pop_back();
  const test::RawPeer next = rig.connect();
  CHECK(rig.stats().receivers() == 16);
  rig.step(0);
  CHECK(rig.stats().sent() == 16);
  CHECK(next.receive(6) == "0 ann ");
}

TEST_CASE("an avatar of Axis Neuron keeps its name, unless a blank would end it") {
  for (const auto& [own, sent] : {std::pair("Walker", "Walker"), std::pair("Ann Li", "ann")}) {
    BvhRig rig(bvh_config());
    drivers::axis::AvatarEntry entry;
    entry.avatar = drivers::axis::make_avatar(3, own);
    const auto avatar = drivers::axis::skeleton_of(entry, 0).value();
    rig.output->stream_comes(info_of(0, "ann", avatar));
    const test::RawPeer peer = rig.connect();
    Frame frame;
    frame.joint_count = static_cast<std::uint16_t>(avatar->joints.size());
    for (std::size_t j = 0; j < frame.joint_count; ++j) frame.rotation_xyzw[j] = kIdentity;
    frame.valid.set();
    rig.now_ns += kBvhFrame_ns;
    rig.pass(frame_of(0, frame), rig.now_ns);
    CHECK(next_lines(peer).starts_with("0 " + std::string(sent) + " "));
  }
}

TEST_CASE("an avatar of Axis Neuron keeps the turns and lengths of all its bones") {
  namespace axis = drivers::axis;
  axis::AvatarEntry entry;
  entry.measured = true;
  entry.avatar = axis::make_avatar(3, "ann");
  for (auto& offset_cm : entry.offset_cm) {
    for (float& x_cm : offset_cm) x_cm *= 1.07F;
  }
  // YXZ and ZXY, as the application is set.
  const auto order = GENERATE(std::uint8_t{0}, std::uint8_t{4});
  const auto skeleton = axis::skeleton_of(entry, order).value();
  Frame frame = frame_of(0, Frame{});
  for (std::size_t b = 0; b < axis::kBones; ++b) {
    const auto at = static_cast<double>(b);
    const Eigen::Vector3d about =
        Eigen::Vector3d(std::sin(at), std::cos(3 * at), std::sin(2 * at) + 0.1).normalized();
    frame.rotation_xyzw[b] =
        from_eigen(Eigen::Quaterniond(Eigen::AngleAxisd(0.2 + 0.01 * at, about)));
    frame.valid.set(b);
  }
  auto figure = AxisFigure::make(skeleton, 0, "ann").value();
  const std::string_view bytes = figure.message(frame);
  axis::Message message;
  REQUIRE(axis::decode_binary(std::as_bytes(std::span(bytes)), message) == Outcome::kOk);
  for (std::size_t b = 0; b < axis::kBones; ++b) {
    const double* values = &message.values[axis::rotations_at(message.content, b)];
    const Eigen::Quaterniond turn =
        Eigen::AngleAxisd(values[0] * kDegree, Eigen::Vector3d::UnitY()) *
        Eigen::AngleAxisd(values[1] * kDegree, Eigen::Vector3d::UnitX()) *
        Eigen::AngleAxisd(values[2] * kDegree, Eigen::Vector3d::UnitZ());
    CHECK(angle_between_rad(turn, to_eigen_double(frame.rotation_xyzw[b])) < 1e-6);
    for (std::size_t k = 0; k < 3 && b > 0; ++k) {
      CHECK(std::abs((values - 3)[k] - static_cast<double>(entry.offset_cm[b][k])) < 1e-5);
    }
  }
}

TEST_CASE("a client that reads a little later gets the lines of many people") {
  constexpr std::size_t kPeople = 16;
  LineClients clients = LineClients::open("127.0.0.1:0", {}, kPeople).value();
  const test::RawPeer peer(clients.endpoint());
  CHECK(clients.look(0).empty());
  const std::string line = std::string(14'000, 'a') + "\n";  // as long as there are
  for (std::size_t i = 0; i < kPeople; ++i) CHECK(clients.send(line, 1).sent == 1);
  std::size_t got = 0;
  for (int i = 0; i < 2000 && got < kPeople * line.size(); ++i) {
    got += peer.receive(1 << 20, std::chrono::milliseconds(1)).size();
    CHECK(clients.look(1).empty());
  }
  CHECK(got == kPeople * line.size());
}

TEST_CASE("only peers that the config names get lines") {
  config::OutputConfig config = bvh_config();
  config.peers = {"192.0.2.7"};
  BvhRig rig(config);
  CHECK(rig.connect().hung_up());
  REQUIRE(rig.reported.size() == 1);
  CHECK(rig.reported[0].find("127.0.0.1 was refused: it is not among the peers") !=
        std::string::npos);
  CHECK(rig.stats().receivers() == 0);
  config.peers.clear();
  config.listen = "0.0.0.0:0";
  const auto open = open_output(config);
  REQUIRE_FALSE(open);
  CHECK(open.error().message.find("in peers") != std::string::npos);
}

}  // namespace posed::output

// Two people with gloves on the virtual daemon: their merged streams lose no frame, have the hands,
// and replay bit for bit, although one of them comes when the gloves are long there.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "daemon/pipeline/stream_settings.hpp"
#include "drivers/options.hpp"
#include "drivers/template_mocap/protocol.hpp"
#include "models/merge/merge_stage.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/device_clip.hpp"
#include "proto/log/reader.hpp"
#include "tests/support/dice.hpp"
#include "tests/support/gapped_logs.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {
namespace {

using drivers::mocap::BodyEntry;
using drivers::mocap::JointEntry;

constexpr double kMergeLength_s = 4.0;
constexpr double kBodyRate_hz = 120.0;
constexpr double kSecondComes_s = 1.5;

std::vector<JointEntry> person_with_arms() {
  std::vector<JointEntry> joints{{"Hips", -1, {0.0F, 0.9F, 0.0F}},
                                 {"Spine", 0, {0.0F, 0.3F, 0.0F}},
                                 {"Head", 1, {0.0F, 0.3F, 0.0F}}};
  for (const auto& [side, sign] : {std::pair("Left", 1.0F), {"Right", -1.0F}}) {
    const int first = static_cast<int>(joints.size());
    const std::string name(side);
    joints.push_back({name + "Arm", 1, {sign * 0.2F, 0.2F, 0.0F}});
    joints.push_back({name + "ForeArm", first, {sign * 0.3F, 0.0F, 0.0F}});
    joints.push_back({name + "Hand", first + 1, {sign * 0.25F, 0.0F, 0.0F}});
  }
  return joints;
}

std::string text_of_datagram(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};  // NOLINT: bytes as text
}

config::StageConfig merge_stage(const std::string& left = "glove-l",
                                const std::string& right = "glove-r") {
  const StageType& type = merge::merge_type();
  return {.type = &type,
          .parameters =
              complete_parameters(type.parameters, {{"left", left}, {"right", right}}).value()};
}

// Ann is there from the start, Bob comes later.
VirtualSource merged_room() {
  VirtualSource source;
  source.bodies = {"Ann", "Bob"};
  source.config.name = "room";
  source.config.driver = "template_mocap";
  source.config.all = true;
  source.config.options =
      drivers::complete_options(*drivers::find_driver("template_mocap"), {}).value();
  source.config.every.stages = {merge_stage()};
  source.slots = 256;
  ScriptedLink link;
  std::vector<BodyEntry> people{{.id = 1, .name = "Ann", .joints = person_with_arms()}};
  const auto describe = [&](double at_s) {
    link.chunks.push_back(
        {.at_s = at_s, .bytes = text_of_datagram(drivers::mocap::encode_description(people))});
  };
  describe(0.0);
  for (std::uint32_t i = 0; i < kMergeLength_s * kBodyRate_hz; ++i) {
    const double at_s = i / kBodyRate_hz;
    if (at_s >= kSecondComes_s && people.size() == 1) {
      people.push_back({.id = 2, .name = "Bob", .joints = person_with_arms()});
      describe(at_s);
    }
    drivers::mocap::FramePacket frame{
        .number = i, .time_us = static_cast<std::uint32_t>(at_s * 1e6), .bodies = {}};
    for (const BodyEntry& person : people) {
      const float bent = static_cast<float>(0.2 * std::sin(4.0 * at_s));
      std::vector<Quatf> pose(person.joints.size(), {0.0F, 0.0F, 0.0F, 1.0F});
      pose[1] = {bent, 0.0F, 0.0F, std::sqrt(1.0F - bent * bent)};
      frame.bodies.push_back({.id = person.id, .root_m = {}, .rotation_xyzw = std::move(pose)});
    }
    link.chunks.push_back(
        {.at_s = at_s, .bytes = text_of_datagram(drivers::mocap::encode_frame(frame))});
  }
  source.links = {std::move(link)};
  return source;
}

constexpr double kHandComes_s = 1.2, kHandLeaves_s = 2.2, kHandReturns_s = 3.0;

// A system that tracks a left hand, which comes late, leaves and returns.
VirtualSource hands() {
  BodyEntry hand{.id = 7, .name = "Left", .joints = {{"LeftHand", -1, {}}}};
  for (const char* finger : {"Thumb", "Index", "Middle", "Ring", "Pinky"}) {
    for (int joint = 1; joint <= 3; ++joint) {
      const int parent = joint == 1 ? 0 : static_cast<int>(hand.joints.size()) - 1;
      hand.joints.push_back(
          {"LeftHand" + std::string(finger) + std::to_string(joint), parent, {0.03F, 0.0F, 0.0F}});
    }
  }
  VirtualSource source;
  source.bodies = {"Left"};
  source.config.name = "hands";
  source.config.driver = "template_mocap";
  source.config.all = true;
  source.config.options =
      drivers::complete_options(*drivers::find_driver("template_mocap"), {}).value();
  source.slots = 256;
  ScriptedLink link;
  bool was_there = false;
  for (std::uint32_t i = 0; i < kMergeLength_s * kBodyRate_hz; ++i) {
    const double at_s = i / kBodyRate_hz;
    const bool there = (at_s >= kHandComes_s && at_s < kHandLeaves_s) || at_s >= kHandReturns_s;
    if (there != was_there) {
      const std::vector<BodyEntry> now = there ? std::vector{hand} : std::vector<BodyEntry>{};
      link.chunks.push_back(
          {.at_s = at_s, .bytes = text_of_datagram(drivers::mocap::encode_description(now))});
    }
    was_there = there;
    if (!there) continue;
    const float bent = static_cast<float>(0.3 * std::sin(5.0 * at_s));
    std::vector<Quatf> pose(hand.joints.size(), {bent, 0.0F, 0.0F, std::sqrt(1.0F - bent * bent)});
    drivers::mocap::FramePacket frame{
        .number = i, .time_us = static_cast<std::uint32_t>(at_s * 1e6), .bodies = {}};
    frame.bodies.push_back({.id = hand.id, .root_m = {}, .rotation_xyzw = std::move(pose)});
    link.chunks.push_back(
        {.at_s = at_s, .bytes = text_of_datagram(drivers::mocap::encode_frame(frame))});
  }
  source.links = {std::move(link)};
  return source;
}

// A clip of a person without fingers.
VirtualStream walker_with(config::StageConfig stage) {
  const TempFolder folder;
  const auto path = folder.path() / "walk.bvh";
  REQUIRE(clip::write_bvh(*motion::make_walker({.seconds = kMergeLength_s}), path));
  const auto walk = clip::open_device_clip(path);
  REQUIRE(walk);
  VirtualStream stream;
  stream.name = "walker";
  stream.description = drivers::find_driver("file")->describe(walk->description, "walk").value();
  stream.settings.stages = {{.type = stage.type, .parameters = std::move(stage.parameters)}};
  stream.model_files = {""};
  stream.slots = 256;
  stream.links.emplace_back();
  for (std::size_t i = 0; i < walk->frames.size(); ++i) {
    stream.links[0].chunks.push_back(
        {.at_s = static_cast<double>(i) / stream.description.rate_hz, .bytes = walk->frames[i]});
  }
  return stream;
}

// A walker from a file and two bodies, all with the hand of another system's body.
void record_with_hand(VirtualDaemon& daemon, std::uint64_t seed, bool trouble) {
  Dice dice(seed);
  daemon.add(walker_with(merge_stage("hands-left", "")));
  VirtualSource room = merged_room();
  room.config.every.stages = {merge_stage("hands-left", "")};
  VirtualSource hand = hands();
  if (trouble && dice.chance(0.7)) disturb(room, dice.seed());
  if (trouble && dice.chance(0.7)) disturb(hand, dice.seed());
  daemon.add(std::move(room));
  daemon.add(std::move(hand));
  daemon.run(kMergeLength_s + 0.5);
}

// Both gloves with stages of their own, one of which delays frames.
void add_gloves(VirtualDaemon& daemon, const std::function<void(VirtualStream&)>& change) {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    VirtualStream glove =
        glove_stream(side == Side::kLeft ? "glove-l" : "glove-r", kMergeLength_s, side);
    change(glove);
    daemon.add(std::move(glove));
  }
}

// Runs the daemon as the seed determines; the log is at `path`.
void record_merged(std::uint64_t seed, const std::filesystem::path& path, VirtualOptions options) {
  Dice dice(seed);
  options.seed = dice.seed();
  options.log = path;
  VirtualDaemon daemon(options);
  add_gloves(daemon, [&](VirtualStream& glove) {
    if (dice.chance(0.7)) disturb(glove, dice.seed());
  });
  VirtualSource room = merged_room();
  if (dice.chance(0.7)) disturb(room, dice.seed());
  daemon.add(std::move(room));
  daemon.run(kMergeLength_s + dice.within(-1.0, 1.0));
}

}  // namespace

TEST_CASE("two people get the hands of the gloves, no frame is lost, and the log replays",
          "[virtual]") {
  const TempFolder folder;
  const auto path = folder.path() / "merged.plog";
  VirtualDaemon daemon({.seed = 3, .log = path, .holdups = false});
  add_gloves(daemon, [](VirtualStream&) {});
  daemon.add(merged_room());
  daemon.run(kMergeLength_s + 0.5);
  REQUIRE(daemon.bodies().size() == 2);
  std::uint64_t frames = daemon.published(0).frames + daemon.published(1).frames;
  for (const VirtualBody& body : daemon.bodies()) {
    INFO(body.name);
    CHECK(body.refusal == "");
    CHECK(body.lost == 0);
    CHECK(body.published.missed == 0);
    const std::set<std::uint64_t> once(body.published.sequences.begin(),
                                       body.published.sequences.end());
    CHECK(once.size() == body.decoded);
    CHECK(body.decoded > (body.body == "Ann" ? 350 : 150));
    frames += body.published.frames;
  }
  const Replayed result = replayed(path);
  REQUIRE((result.difference ? result.difference->text() : "") == "");
  CHECK(result.counts.compared == frames);
  // The hands are there: measured, and moving.
  std::set<float> seen;
  std::size_t merged = 0, with_hands = 0;
  for (const std::string& bytes : result.frames) {
    v1::Frame frame;
    REQUIRE(frame.ParseFromString(bytes));
    if (frame.stream() != "room-ann") continue;
    REQUIRE(frame.validity().size() == 9 + 2 * kHandJoints);
    ++merged;
    if (std::ranges::all_of(frame.validity(), [](char valid) { return valid == 1; })) ++with_hands;
    seen.insert(frame.rotation_xyzw(frame.rotation_xyzw_size() - 1));
  }
  CHECK(with_hands + 30 > merged);
  CHECK(seen.size() > 50);  // the motion repeats every second, the second half backwards
}

TEST_CASE("a body that comes late gives its hand to streams that were there before, and again",
          "[virtual]") {
  const TempFolder folder;
  const auto path = folder.path() / "late.plog";
  VirtualDaemon daemon({.seed = 5, .log = path, .holdups = false});
  record_with_hand(daemon, 5, false);
  std::map<std::string, std::size_t> streams, with_fingers;
  for (const VirtualBody& body : daemon.bodies()) {
    INFO(body.name);
    CHECK(body.refusal == "");
    CHECK(body.published.missed == 0);
    ++streams[body.name];
  }
  // Before the hand, with the hand, with the hand that has returned; Bob comes with the hand.
  CHECK(streams["room-ann"] == 3);
  CHECK(streams["room-bob"] == 2);
  CHECK(streams["hands-left"] == 2);
  CHECK(daemon.published(0).missed == 0);
  CHECK(daemon.published(0).frames > 110);  // 30 a second
  const Replayed result = replayed(path);
  REQUIRE((result.difference ? result.difference->text() : "") == "");
  CHECK(result.counts.lost + result.counts.after_gap + result.counts.past_end == 0);
  for (const std::string& bytes : result.frames) {
    v1::Frame frame;
    REQUIRE(frame.ParseFromString(bytes));
    // A person has nine joints without the hand, the walker a few more.
    const auto valid = std::ranges::count(frame.validity(), 1);
    if (valid >= kHandJoints + 9) ++with_fingers[frame.stream()];
  }
  CHECK(with_fingers["room-ann"] > 150);
  CHECK(with_fingers["walker"] > 40);
  const auto reader = log::Reader::open(path);
  REQUIRE(reader);
  const auto of_walker = [](const log::StreamRow& row) { return row.name == "walker"; };
  CHECK(std::ranges::count_if(reader->streams(), of_walker) >= 3);
}

TEST_CASE("whatever happens to a partner that comes and goes, the log replays bit for bit",
          "[property][virtual]") {
  const TempFolder folder;
  const auto path = folder.path() / "late.plog";
  const auto [first, last] = seeds(8);
  std::uint64_t compared = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("seed " << seed << "; POSED_SEED=" << seed << " runs it alone");
    VirtualDaemon daemon({.seed = seed, .log = path});
    record_with_hand(daemon, seed, true);
    const Replayed result = replayed(path);
    REQUIRE((result.difference ? result.difference->text() : "") == "");
    CHECK(result.counts.after_gap + result.counts.past_end == 0);
    compared += result.counts.compared;
    std::filesystem::remove(path);
  }
  CHECK(compared > 0);
}

TEST_CASE("whatever happens to bodies and gloves, a merged log replays bit for bit",
          "[property][virtual]") {
  const TempFolder folder;
  const auto path = folder.path() / "merged.plog";
  const auto [first, last] = seeds(8);
  std::uint64_t compared = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("seed " << seed << "; POSED_SEED=" << seed << " runs it alone");
    record_merged(seed, path, {});
    const Replayed result = replayed(path);
    REQUIRE((result.difference ? result.difference->text() : "") == "");
    CHECK(result.counts.after_gap + result.counts.past_end == 0);
    compared += result.counts.compared;
    std::filesystem::remove(path);
  }
  WARN(last - first + 1 << " runs, " << compared << " frames compared");
}

// What a glove's gap hides is unknown for the bodies that have its hand, too.
TEST_CASE("a merged log with gaps replays what it contains and reports what is missing",
          "[property][virtual]") {
  check_gapped_logs(8, [](Dice& dice, std::uint64_t seed, const std::filesystem::path& path) {
    VirtualOptions scarce;
    scarce.chunk_bytes = static_cast<std::size_t>(1000 * dice.below(60) + 2000);
    scarce.record_slot = {.frame_bytes = static_cast<std::size_t>(1000 * dice.below(60) + 2000),
                          .decisions = static_cast<std::size_t>(dice.below(12) + 1)};
    record_merged(seed, path, scarce);
  });
}

}  // namespace posed::test

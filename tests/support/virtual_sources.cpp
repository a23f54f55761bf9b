// A source of a VirtualDaemon: a room with people, as the template mocap system sees it.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/options.hpp"
#include "drivers/template_mocap/protocol.hpp"
#include "models/generate/generate_stage.hpp"
#include "models/style/live/style_type.hpp"
#include "models/style/model/style_model.hpp"
#include "tests/support/dice.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/virtual_daemon.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test {
namespace {

using drivers::mocap::BodyEntry;
using drivers::mocap::BodyPose;
using drivers::mocap::FramePacket;
using drivers::mocap::JointEntry;
using drivers::mocap::Kind;

using Bytes = std::vector<std::byte>;

// Skeletons that a person may have. The style model of toy_style.hpp fits all but the third; the
// first and the last have the same number of joints.
constexpr int kFigures = 4;
std::vector<JointEntry> figure(int which) {
  std::vector<JointEntry> joints{{"Hips", -1, {0.0F, 0.9F, 0.0F}},
                                 {"Spine", 0, {0.0F, 0.3F, 0.0F}},
                                 {"Head", 1, {0.0F, 0.3F, 0.0F}},
                                 {"LeftLeg", 0, {0.1F, -0.4F, 0.0F}},
                                 {"RightLeg", 0, {-0.1F, -0.4F, 0.0F}}};
  if (which == 1) joints.push_back({"RightFoot", 4, {0.0F, -0.4F, 0.0F}});
  if (which == 2) joints.resize(2);
  if (which == 3) joints[2].offset_m[1] = 0.35F;
  return joints;
}

Quatf turn(double angle_rad) {
  return {static_cast<float>(std::sin(angle_rad / 2)), 0.0F, 0.0F,
          static_cast<float>(std::cos(angle_rad / 2))};
}

class Room {
 public:
  Room(const std::vector<std::string>& names, double length_s, Dice& dice)
      : dice_(dice), length_s_(length_s), rate_hz_(dice.within(60.0, 120.0)) {
    for (const std::string& name : names) {
      people_.push_back({.entry = {.id = static_cast<std::uint16_t>(people_.size() + 1),
                                   .name = name,
                                   .joints = figure(dice.below(kFigures))},
                         .present = dice.chance(0.7)});
    }
  }

  std::vector<ScriptedChunk> play() {
    describe_s_ = dice_.within(0.0, 0.3);
    const double changes_hz = dice_.within(0.5, 6.0);
    const double repeated_s = dice_.within(0.2, 1.0);
    for (std::uint32_t i = 0; i < length_s_ * rate_hz_; ++i) {
      now_s_ = i / rate_hz_;
      if (now(changes_hz)) change();
      if (now(0.15)) flicker_until_s_ = now_s_ + dice_.within(0.1, 0.6);
      if (now_s_ < flicker_until_s_ && now(30.0)) describe_others();
      if (now(1.0)) describe_badly();
      if (now_s_ >= describe_s_) {
        send(drivers::mocap::encode_description(entries()));
        describe_s_ = now_s_ + repeated_s;
      }
      if (now(0.1)) clock_s_ += 100.0;
      if (now(0.1)) number_ = 0;
      send_frame();
    }
    return std::move(chunks_);
  }

 private:
  struct Person {
    BodyEntry entry;
    bool present = true;
  };

  // Whether what happens so many times a second happens before the next frame.
  bool now(double rate_hz) { return dice_.chance(std::min(rate_hz / rate_hz_, 1.0)); }

  // Most changes are described at once, some later, and some only by the next repetition.
  void change() {
    Person& person =
        people_[static_cast<std::size_t>(dice_.below(static_cast<int>(people_.size())))];
    switch (dice_.below(8)) {
      case 0:
      case 1:
      case 2:
        person.entry.joints = figure(dice_.below(kFigures));
        break;
      case 3:
        person.entry.id = static_cast<std::uint16_t>(++last_id_);
        break;
      case 4:
        std::swap(people_.front(), people_.back());
        break;
      default:
        person.present = !person.present;
    }
    if (dice_.chance(0.6))
      describe_s_ = now_s_;
    else if (dice_.chance(0.7))
      describe_s_ = std::min(describe_s_, now_s_ + dice_.within(0.0, 0.3));
  }

  std::vector<BodyEntry> entries() const {
    std::vector<BodyEntry> entries;
    for (const Person& person : people_) {
      if (person.present) entries.push_back(person.entry);
    }
    return entries;
  }

  // As often as frames: one person is there, then not, then has other joints.
  void describe_others() {
    const Person other = people_.back();
    people_.back().present = dice_.chance(0.5);
    if (dice_.chance(0.3)) people_.back().entry.joints = figure(dice_.below(kFigures));
    send(drivers::mocap::encode_description(entries()));
    people_.back() = other;
    describe_s_ = std::min(describe_s_, std::max(flicker_until_s_, now_s_));
  }

  void describe_badly() {
    std::vector<BodyEntry> entries = this->entries();
    if (entries.empty()) return;
    Bytes bytes;
    switch (dice_.below(4)) {
      case 0:
        bytes = drivers::mocap::encode_description(entries);
        bytes.resize(bytes.size() / 2);
        break;
      case 1:
        entries.push_back(entries.front());
        bytes = drivers::mocap::encode_description(entries);
        break;
      case 2:
        entries.front().joints.front().parent = 3;
        bytes = drivers::mocap::encode_description(entries);
        break;
      default:
        bytes = drivers::mocap::encode_datagram(Kind::kDescription, {});
    }
    send(bytes);
    describe_s_ = std::min(describe_s_, now_s_ + dice_.within(0.05, 0.5));
  }

  void send_frame() {
    FramePacket packet{.number = ++number_,
                       .time_us = static_cast<std::uint32_t>((now_s_ + clock_s_) * 1e6),
                       .bodies = {}};
    for (const Person& person : people_) {
      if (!person.present) continue;
      BodyPose& pose = packet.bodies.emplace_back();
      pose.id = person.entry.id;
      pose.root_m = {static_cast<float>(now_s_), 0.9F, static_cast<float>(pose.id)};
      for (std::size_t j = 0; j < person.entry.joints.size(); ++j) {
        pose.rotation_xyzw.push_back(turn(0.4 * std::sin(6.0 * now_s_ + static_cast<double>(j))));
      }
      if (now(1.0)) pose.rotation_xyzw.back() = {};  // not seen
      if (now(0.5)) pose.root_m[0] = std::numeric_limits<float>::quiet_NaN();
    }
    if (now(0.5)) packet.bodies.push_back({.id = 999, .root_m = {}, .rotation_xyzw = {turn(0.0)}});
    send(drivers::mocap::encode_frame(packet));
  }

  void send(const Bytes& bytes) {
    chunks_.push_back({.at_s = now_s_,
                       .bytes = {reinterpret_cast<const char*>(bytes.data()),  // NOLINT: as text
                                 bytes.size()}});
  }

  Dice& dice_;
  double length_s_, rate_hz_;
  std::vector<Person> people_;
  std::vector<ScriptedChunk> chunks_;
  double now_s_ = 0.0, clock_s_ = 0.0;
  double describe_s_ = 0.0;        // when the description is due
  double flicker_until_s_ = -1.0;  // until then others come all the time
  std::uint32_t number_ = 0;
  int last_id_ = 20;
};

config::StageConfig stage(const StageType& type, const std::filesystem::path& model = {}) {
  return {.type = &type,
          .parameters = complete_parameters(type.parameters, {}).value(),
          .model = model};
}

}  // namespace

VirtualSource mocap_source(const std::string& name, double length_s, std::uint64_t seed) {
  Dice dice(seed);
  VirtualSource source;
  source.bodies = {"Ann", "ANN", "Bob", "Cleo", "Dr. Dee", "Eve"};
  source.bodies.resize(static_cast<std::size_t>(2 + dice.below(5)));
  const auto files = std::make_shared<TempFolder>();
  const auto model = files->write("toy.pmodel", style::serialize_model(toy_model(1)));
  source.files = files;
  config::SourceConfig& config = source.config;
  config.name = name;
  config.driver = "template_mocap";
  const drivers::Driver& driver = *drivers::find_driver(config.driver);
  config.options = drivers::complete_options(driver, {}).value();
  config.all = dice.chance(0.9);
  config.every.publish_raw = dice.chance(0.3);
  if (dice.chance(0.6)) config.every.stages.push_back(stage(style::style_type(), model));
  if (dice.chance(0.4) || !config.all) {
    config::StreamConfig named;
    named.name = name + "-named";
    named.publish_raw = dice.chance(0.5);
    if (dice.chance(0.5)) named.stages.push_back(stage(style::style_type(), model));
    // These bodies have no joint angles, so this one is always refused.
    if (dice.chance(0.1)) named.stages.push_back(stage(generate::generate_type()));
    config.named.push_back({.body = source.bodies[1], .stream = std::move(named)});
  }
  source.poll = {.request = drivers::mocap::encode_request(), .period_ns = kNanosPerSecond};
  source.links.push_back({.chunks = Room(source.bodies, length_s, dice).play(), .flood = {}});
  return source;
}

VirtualSource guest_source(const std::string& name, double back_s, double end_s) {
  constexpr double kRate_hz = 50.0;
  constexpr std::uint16_t kGuest = 500;  // nobody else's number
  VirtualSource source;
  source.bodies = {"Gia"};
  source.config.name = name;
  source.config.driver = "template_mocap";
  source.config.options =
      drivers::complete_options(*drivers::find_driver("template_mocap"), {}).value();
  source.config.named.push_back({.body = "Gia", .stream = {}});
  source.config.named[0].stream.name = name;
  std::vector<ScriptedChunk> chunks;
  const auto send = [&](double at_s, const Bytes& bytes) {
    chunks.push_back({.at_s = at_s,
                      .bytes = {reinterpret_cast<const char*>(bytes.data()),  // NOLINT: as text
                                bytes.size()}});
  };
  for (std::uint32_t i = 0; i < end_s * kRate_hz; ++i) {
    const double now_s = i / kRate_hz;
    const bool here = now_s < back_s / 2 || now_s >= back_s;
    std::vector<BodyEntry> entries;
    FramePacket packet{
        .number = i + 1, .time_us = static_cast<std::uint32_t>(now_s * 1e6), .bodies = {}};
    if (here) {
      entries.push_back({.id = kGuest, .name = "Gia", .joints = figure(0)});
      BodyPose& pose = packet.bodies.emplace_back();
      pose.id = kGuest;
      pose.root_m = {static_cast<float>(now_s), 0.9F, static_cast<float>(kGuest)};
      pose.rotation_xyzw.assign(entries[0].joints.size(), turn(0.3 * std::sin(6.0 * now_s)));
    }
    if (i % 10 == 0) send(now_s, drivers::mocap::encode_description(entries));
    send(now_s, drivers::mocap::encode_frame(packet));
  }
  source.links.push_back({.chunks = std::move(chunks), .flood = {}});
  return source;
}

}  // namespace posed::test

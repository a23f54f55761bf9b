#include "drivers/mvn/emulator.hpp"

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>

#include "drivers/emulate/motion.hpp"
#include "drivers/mvn/encode.hpp"
#include "drivers/mvn/figure.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::mvn {

Character emulated_walker() { return average_character(0, "Walker", 1.0F, /*fingers=*/true); }

Character emulated_waver() { return average_character(1, "Waver", 0.9F, /*fingers=*/false); }

namespace {

std::string time_text(std::int64_t time_ns) {
  const std::int64_t ms = time_ns / 1'000'000;
  std::array<char, 40> text{};
  (void)std::snprintf(text.data(), text.size(), "%02d:%02d:%02d.%03d",
                      static_cast<int>(ms / 3'600'000 % 24), static_cast<int>(ms / 60'000 % 60),
                      static_cast<int>(ms / 1000 % 60), static_cast<int>(ms % 1000));
  return {text.data(), 12};
}

}  // namespace

MvnEmulator::MvnEmulator(Settings settings)
    : settings_(std::move(settings)), samples_(nanoseconds(1.0 / settings_.rate_hz)) {
  for (const Character& character : {emulated_walker(), emulated_waver()}) {
    if (people_.size() == settings_.characters) break;
    Person& person = people_.emplace_back();
    person.character = character;
    person.skeleton = skeleton_of(character).value();
    person.rotation_xyzw.fill(kIdentity);
  }
  samples_.start(0);
}

const Skeleton* MvnEmulator::skeleton(std::size_t body) const {
  return body < people_.size() ? people_[body].skeleton.get() : nullptr;
}

void MvnEmulator::pose(std::size_t body, const Frame& frame) {
  if (body >= people_.size()) return;
  Person& person = people_[body];
  person.posed = true;
  person.root_m = frame.root_position_m;
  const JointTable& table = joint_table(person.character.fingers);
  for (std::size_t j = 0; j < std::min<std::size_t>(table.count, frame.joint_count); ++j) {
    person.rotation_xyzw[table.segment[j]] = frame.valid[j] ? frame.rotation_xyzw[j] : Quatf{};
  }
}

std::int64_t MvnEmulator::next_due_ns() const {
  return queue_.empty() ? samples_.due_ns() : queued_ns_;
}

void MvnEmulator::emit(std::int64_t now_ns, Bytes& out) {
  if (queue_.empty()) fill_queue(now_ns);
  if (queue_.empty()) return;  // nobody is present
  out.insert(out.end(), queue_.front().begin(), queue_.front().end());
  queue_.pop_front();
}

void MvnEmulator::fill_queue(std::int64_t now_ns) {
  queued_ns_ = samples_.due_ns();
  samples_.step(now_ns);
  const double time_s = seconds(queued_ns_);
  for (std::size_t body = 0; body < people_.size(); ++body) move(body, time_s);
  const bool notify = reported_ns_ == kNoTime_ns || queued_ns_ - reported_ns_ >= kNanosPerSecond;
  if (notify) reported_ns_ = queued_ns_;
  for (const Person& person : people_) {
    for (const Type type : settings_.types) {
      const bool reported_once = type == Type::kMeta || type == Type::kScale;
      if (person.present && (notify || !reported_once)) add_sample(person, type, queued_ns_);
    }
  }
  ++sample_;
}

void MvnEmulator::move(std::size_t body, double time_s) {
  Person& person = people_[body];
  if (person.posed) return;
  const auto& segment = joint_table(person.character.fingers).segment;
  auto& q = person.rotation_xyzw;
  const auto turn = [&](Bone bone, const Eigen::Quaterniond& rotation) {
    q[segment[person.skeleton->joint_of(bone)]] = from_eigen(rotation);
  };
  if (body == 1) {
    person.root_m = emulate::wave(time_s, 0.88F, turn);
    return;
  }
  person.root_m = emulate::walk(time_s, 0.98F, turn);
  const double swing = emulate::swing_rad(time_s, 0.5);
  q[4] = from_eigen(axis_rotation(Axis::kY, 0.1 * swing));
  // The fingers open and close.
  for (std::size_t i = 5; i < kHandSegments; ++i) {
    if (i % 4 == 0) continue;  // metacarpals
    q[kLeftFingers + i] = from_eigen(axis_rotation(Axis::kZ, -0.5 + swing));
    q[kRightFingers + i] = from_eigen(axis_rotation(Axis::kZ, 0.5 - swing));
  }
}

void MvnEmulator::add_sample(const Person& person, Type type, std::int64_t time_ns) {
  const Character& character = person.character;
  Head head{.type = type,
            .sample = sample_,
            .items = 1,
            .time_ms = static_cast<std::uint32_t>(time_ns / 1'000'000),
            .character = character.id,
            .body = kBodySegments,
            .fingers = static_cast<std::uint8_t>(character.segments() - kBodySegments)};
  const auto add = [&](std::span<const std::byte> payload) {
    queue_.push_back(encode_datagram(head, payload));
  };
  const auto add_items = [&](std::span<const std::byte> payload) {
    head.items = static_cast<std::uint8_t>(payload.size() / item_bytes(type));
    for (auto& part : encode_sample(head, payload, settings_.longest)) {
      queue_.push_back(std::move(part));
    }
  };
  switch (type) {
    case Type::kMeta:
      return add(encode_meta({character.name.data(), character.name_bytes}));
    case Type::kScale:
      return add(encode_scale(t_pose_of(character)));
    case Type::kCentreOfMass:
      return add(encode_centre_of_mass(person.root_m));
    case Type::kTimeCode:
      return add(encode_timecode(time_text(time_ns)));
    case Type::kJointAngles:
    case Type::kLinear:
    case Type::kAngular:
    case Type::kTrackers:
      return add_items(encode_values(
          type, pose_of(character, person.root_m, person.rotation_xyzw, /*local=*/false)));
    default:
      return add_items(encode_pose(
          type, pose_of(character, person.root_m, person.rotation_xyzw, type == Type::kUnity)));
  }
}

}  // namespace posed::drivers::mvn

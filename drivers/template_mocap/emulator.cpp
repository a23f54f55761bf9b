#include "drivers/template_mocap/emulator.hpp"

#include <algorithm>

#include "drivers/emulate/motion.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::mocap {
namespace {

constexpr std::int64_t kDescribeEvery_ns = kNanosPerSecond;
constexpr float kHips_m = 0.95F;  // above the floor

// A person of 1.7 m in T-pose.
std::vector<JointEntry> upper_body() {
  return {{"hips", -1, {0.0F, kHips_m, 0.0F}},       {"chest", 0, {0.0F, 0.3F, 0.0F}},
          {"head", 1, {0.0F, 0.3F, 0.0F}},           {"leftUpperArm", 1, {0.18F, 0.2F, 0.0F}},
          {"leftLowerArm", 3, {0.28F, 0.0F, 0.0F}},  {"rightUpperArm", 1, {-0.18F, 0.2F, 0.0F}},
          {"rightLowerArm", 5, {-0.28F, 0.0F, 0.0F}}};
}

std::vector<JointEntry> whole_body() {
  auto joints = upper_body();
  joints.push_back({"leftUpperLeg", 0, {0.1F, -0.05F, 0.0F}});
  joints.push_back({"leftLowerLeg", 7, {0.0F, -0.45F, 0.0F}});
  joints.push_back({"rightUpperLeg", 0, {-0.1F, -0.05F, 0.0F}});
  joints.push_back({"rightLowerLeg", 9, {0.0F, -0.45F, 0.0F}});
  return joints;
}

}  // namespace

MocapEmulator::MocapEmulator(double rate_hz)
    : frames_(nanoseconds(1.0 / rate_hz)), descriptions_(kDescribeEvery_ns) {
  people_.resize(2);
  people_[0].entry = {.id = 1, .name = "Walker", .joints = whole_body()};
  people_[1].entry = {.id = 7, .name = "Waver", .joints = upper_body()};
  for (Person& person : people_) {
    person.skeleton = skeleton_of(person.entry).value();
    person.pose.id = person.entry.id;
    person.pose.rotation_xyzw.assign(person.entry.joints.size(), kIdentity);
  }
  frames_.start(0);
  descriptions_.start(0);
}

const Skeleton* MocapEmulator::skeleton(std::size_t body) const {
  return body < people_.size() ? people_[body].skeleton.get() : nullptr;
}

void MocapEmulator::pose(std::size_t body, const Frame& frame) {
  if (body >= people_.size()) return;
  Person& person = people_[body];
  person.posed = true;
  person.pose.root_m = frame.root_position_m;
  auto& rotations = person.pose.rotation_xyzw;
  for (std::size_t j = 0; j < std::min<std::size_t>(rotations.size(), frame.joint_count); ++j) {
    rotations[j] = frame.valid[j] ? frame.rotation_xyzw[j] : Quatf{};
  }
}

void MocapEmulator::receive(std::span<const std::byte> bytes, std::int64_t /*now_ns*/,
                            Bytes& /*answer*/) {
  Datagram datagram;
  if (decode_datagram(bytes, datagram) == Outcome::kOk && datagram.kind == Kind::kRequest) {
    changed_ = true;
  }
}

void MocapEmulator::set_present(std::size_t body, bool present) {
  people_[body].present = present;
  changed_ = true;
}

// A new body is described before its first frame.
std::int64_t MocapEmulator::next_due_ns() const {
  if (changed_) return frames_.due_ns() - 1;
  return std::min(frames_.due_ns(), descriptions_.due_ns());
}

void MocapEmulator::emit(std::int64_t now_ns, Bytes& out) {
  if (changed_ || descriptions_.due_ns() <= frames_.due_ns()) {
    if (!changed_) descriptions_.step(now_ns);
    changed_ = false;
    return describe(out);
  }
  const std::int64_t time_ns = frames_.due_ns();
  frames_.step(now_ns);
  move(seconds(time_ns));
  FramePacket packet{
      .number = number_++, .time_us = static_cast<std::uint32_t>(time_ns / 1000), .bodies = {}};
  for (const Person& person : people_) {
    if (person.present) packet.bodies.push_back(person.pose);
  }
  const auto bytes = encode_frame(packet);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

void MocapEmulator::move(double time_s) {
  for (std::size_t body = 0; body < people_.size(); ++body) {
    Person& person = people_[body];
    if (person.posed) continue;
    const auto turn = [&](Bone bone, const Eigen::Quaterniond& rotation) {
      person.pose.rotation_xyzw[person.skeleton->joint_of(bone)] = from_eigen(rotation);
    };
    person.pose.root_m =
        body == 0 ? emulate::walk(time_s, kHips_m, turn) : emulate::wave(time_s, kHips_m, turn);
  }
}

void MocapEmulator::describe(Bytes& out) const {
  std::vector<BodyEntry> entries;
  for (const Person& person : people_) {
    if (person.present) entries.push_back(person.entry);
  }
  const auto bytes = encode_description(entries);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace posed::drivers::mocap

#include "drivers/natnet/emulator.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "drivers/byte_reader.hpp"
#include "drivers/byte_writer.hpp"
#include "drivers/emulate/motion.hpp"
#include "drivers/emulate/pace.hpp"
#include "drivers/natnet/axes.hpp"
#include "drivers/natnet/figure.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::natnet {
namespace {

constexpr std::uint64_t kEmulatedClock_hz = 10'000'000;
constexpr std::size_t kWandBody = 1;
constexpr std::size_t kMaxAdded = 4;  // people
constexpr std::int32_t kFirstAddedId = 100;

// The server's computer has been on for an hour.
std::uint64_t ticks_at(std::int64_t time_ns) {
  return 3600 * kEmulatedClock_hz +
         static_cast<std::uint64_t>(time_ns) / (kNanosPerSecond / kEmulatedClock_hz);
}

// Compiles the emulator's own description with make_layout, so that its skeletons are those that
// the host will build.
std::unique_ptr<const SourceLayout> layout_of(const ModelDef& model, Version version) {
  const auto description = encode_description(model, version, {.version = version});
  return make_layout(description).value();
}

}  // namespace

NatNetEmulator::NatNetEmulator(const Settings& settings)
    : settings_(settings), frames_(nanoseconds(1.0 / settings.rate_hz)) {
  if (!settings_.version.known()) settings_.version = {3, 1};
  poses_.resize(emulated_model().bodies.size());
  learn_bodies();
  frames_.start(0);
}

void NatNetEmulator::learn_bodies() {
  layout_ = layout_of(bodies(), settings_.version);
  for (std::size_t body = 0; body < poses_.size(); ++body) {
    const std::size_t joints = layout_->bodies[body].skeleton->joints.size();
    poses_[body].rotation_xyzw.assign(joints, kIdentity);
    poses_[body].valid.assign(joints, true);
  }
}

bool NatNetEmulator::add_person() {
  if (poses_.size() > kMaxAdded + kWandBody) return false;
  poses_.emplace_back().root_m = {0.0F, 0.95F, 0.0F};
  learn_bodies();
  return true;
}

ModelDef NatNetEmulator::bodies() const {
  ModelDef all = emulated_model();
  for (std::size_t body = all.bodies.size(); body < poses_.size(); ++body) {
    const auto number = static_cast<std::int32_t>(body);
    all.bodies.push_back(average_person("Person" + std::to_string(number), kFirstAddedId + number,
                                        1.0F, /*fingers=*/true));
  }
  return all;
}

const Skeleton* NatNetEmulator::skeleton(std::size_t body) const {
  return body < layout_->bodies.size() ? layout_->bodies[body].skeleton.get() : nullptr;
}

void NatNetEmulator::pose(std::size_t body, const Frame& frame) {
  if (body >= poses_.size()) return;
  Pose& pose = poses_[body];
  pose.posed = true;
  pose.root_m = frame.root_position_m;
  const std::size_t joints = std::min<std::size_t>(pose.valid.size(), frame.joint_count);
  for (std::size_t j = 0; j < joints; ++j) {
    pose.rotation_xyzw[j] = frame.rotation_xyzw[j];
    pose.valid[j] = frame.valid[j];
  }
}

void NatNetEmulator::receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) {
  Message message;
  if (decode_message(bytes, message) != Outcome::kOk) return;
  Bytes datagram;
  switch (message.id) {
    case MessageId::kConnect:
    case MessageId::kDiscovery:
      datagram = encode_server_info({.version = settings_.version,
                                     .clock_hz = kEmulatedClock_hz,
                                     .data_port = kDataPort,
                                     .multicast = !settings_.unicast,
                                     .group = kGroup});
      break;
    case MessageId::kRequestModelDef:
      datagram = encode_model_def(model(), settings_.version);
      break;
    case MessageId::kRequest: {
      ByteWriter rate;
      rate.f32(static_cast<float>(settings_.rate_hz));
      const bool asked = ByteReader(message.payload).text(9) == "FrameRate";
      datagram = asked ? encode_message(MessageId::kResponse, rate.finish())
                       : encode_message(MessageId::kUnrecognized, {});
      break;
    }
    case MessageId::kEchoRequest: {
      ByteWriter ticks;
      ticks.u64(ByteReader(message.payload).u64());
      ticks.u64(ticks_at(now_ns));
      datagram = encode_message(MessageId::kEchoResponse, ticks.finish());
      break;
    }
    default:
      break;  // nothing to answer
  }
  answer.insert(answer.end(), datagram.begin(), datagram.end());
}

void NatNetEmulator::set_wand(bool present) {
  wand_ = present;
  changed_ = true;
}

ModelDef NatNetEmulator::model() const {
  ModelDef model = bodies();
  if (!wand_) model.bodies.erase(model.bodies.begin() + kWandBody);
  for (BodyDef& body : model.bodies) {
    for (BoneDef& bone : body.bones) bone.offset_m = to_motive(bone.offset_m, settings_.z_up);
  }
  return model;
}

void NatNetEmulator::emit(std::int64_t now_ns, Bytes& out) {
  Bytes datagram;
  if (!described_) {
    described_ = true;
    datagram = encode_model_def(model(), settings_.version);
  } else {
    const std::int64_t time_ns = frames_.due_ns();
    frames_.step(now_ns);
    move(seconds(time_ns));
    FramePacket packet{.number = number_++,
                       .timecode = emulate::timecode_at(time_ns),
                       .timestamp_s = seconds(time_ns),
                       .exposure_ticks = ticks_at(time_ns),
                       .received_ticks = ticks_at(time_ns) + 1000,
                       .sent_ticks = ticks_at(time_ns) + 2000,
                       .bodies_changed = std::exchange(changed_, false)};
    for (std::size_t body = 0; body < poses_.size(); ++body) {
      if (body != kWandBody) packet.skeletons.push_back(person(body));
    }
    if (wand_) add_wand(packet);
    const bool timestamp = settings_.version >= Version{2, 6};  // Motive 1.5 sends none
    datagram = encode_frame(packet, {.version = settings_.version, .timestamp = timestamp});
  }
  out.insert(out.end(), datagram.begin(), datagram.end());
}

void NatNetEmulator::move(double time_s) {
  if (Pose& pose = poses_[0]; !pose.posed) {
    const Skeleton& skeleton = *layout_->bodies[0].skeleton;
    const auto turn = [&](Bone bone, const Eigen::Quaterniond& rotation) {
      pose.rotation_xyzw[skeleton.joint_of(bone)] = from_eigen(rotation);
    };
    pose.root_m = emulate::walk(time_s, 0.95F, turn);
    turn(Bone::kLeftIndexProximal,
         axis_rotation(Axis::kZ, -std::abs(emulate::swing_rad(time_s, 0.5))));
  }
  if (Pose& pose = poses_[kWandBody]; !pose.posed) {
    pose.root_m = {0.5F, 1.2F, -0.5F};
    pose.rotation_xyzw[0] = from_eigen(axis_rotation(Axis::kY, -emulate::heading_rad(time_s)));
  }
}

SkeletonPacket NatNetEmulator::person(std::size_t body) const {
  const Pose& pose = poses_[body];
  const auto& table = static_cast<const NatNetLayout&>(*layout_).tables[body];
  const bool local = settings_.coordinates == Coordinates::kLocal;
  SkeletonPacket packet{.id = table.id};
  std::vector<Eigen::Vector3d> at_m;
  std::vector<Eigen::Quaterniond> turned;
  for (std::size_t j = 0; j < table.bone_ids.size(); ++j) {
    const Vec3f& offset = j == 0 ? pose.root_m : table.offsets_m[j];
    Eigen::Vector3d here_m = Eigen::Vector3f(offset.data()).cast<double>();
    Eigen::Quaterniond rotation = to_eigen_double(pose.rotation_xyzw[j]);
    if (j > 0 && !local) {
      const std::size_t parent = table.parents[j];
      here_m = at_m[parent] + turned[parent] * here_m;
      rotation = turned[parent] * rotation;
    }
    at_m.push_back(here_m);
    turned.push_back(rotation);
    const Eigen::Vector3f rounded_m = here_m.cast<float>();
    packet.bones.push_back({.id = static_cast<std::int32_t>(
                                static_cast<std::uint32_t>(table.id) << 16 | table.bone_ids[j]),
                            .position_m = to_motive(
                                Vec3f{rounded_m.x(), rounded_m.y(), rounded_m.z()}, settings_.z_up),
                            .rotation_xyzw = to_motive(from_eigen(rotation), settings_.z_up),
                            .tracked = pose.valid[j]});
  }
  return packet;
}

void NatNetEmulator::add_wand(FramePacket& packet) const {
  const Pose& pose = poses_[kWandBody];
  packet.rigid_bodies.push_back({.id = kWandId,
                                 .position_m = to_motive(pose.root_m, settings_.z_up),
                                 .rotation_xyzw = to_motive(pose.rotation_xyzw[0], settings_.z_up),
                                 .tracked = pose.valid[0]});
  for (std::size_t i = 0; i < kWandMarkers_m.size(); ++i) {
    const Eigen::Vector3f place_m =
        Eigen::Vector3f(pose.root_m.data()) +
        to_eigen(pose.rotation_xyzw[0]) * Eigen::Vector3f(kWandMarkers_m[i].data());
    packet.labelled.push_back(
        {.model = static_cast<std::uint16_t>(kWandId),
         .number = static_cast<std::uint16_t>(i + 1),
         .position_m = to_motive(Vec3f{place_m.x(), place_m.y(), place_m.z()}, settings_.z_up),
         .occluded = i == 3});
  }
}

}  // namespace posed::drivers::natnet

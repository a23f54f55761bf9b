#include "daemon/output/natnet_scene.hpp"

#include <algorithm>
#include <utility>

#include "daemon/output/datagram_encoder.hpp"
#include "drivers/natnet/figure.hpp"

namespace posed::output {
namespace {

namespace natnet = drivers::natnet;

// Whether it is one of Motive's: with its own names, or with those that it gives for FBX and BVH.
// Files of such names have channels.
bool is_of_motive(const Skeleton& skeleton) {
  const auto is_named = [&](Bone bone, std::string_view name) {
    const int joint = skeleton.joint_of(bone);
    return joint >= 0 && skeleton.joints[joint].name == name;
  };
  const bool named =
      is_named(Bone::kHips, "Hip") ||
      (is_named(Bone::kHips, "Hips") &&
       (is_named(Bone::kLeftUpperArm, "LeftArm") || is_named(Bone::kLeftUpperArm, "LeftShoulder")));
  return named && skeleton.channels.empty() && skeleton.joints[0].bone == Bone::kHips &&
         rests_unturned(skeleton);
}

natnet::BodyDef describe_body(const Skeleton& skeleton, const std::string& name, std::int32_t id,
                              bool prop) {
  natnet::BodyDef body{.name = name, .id = id, .is_skeleton = !prop, .bones = {}};
  for (const Joint& joint : skeleton.joints) {
    const Eigen::Vector3f offset_m = joint.offset_m.cast<float>();
    body.bones.push_back({.name = name + "_" + joint.name,
                          .id = static_cast<std::int32_t>(body.bones.size()) + 1,
                          .parent = joint.parent + 1,  // 0: none
                          .offset_m = {offset_m.x(), offset_m.y(), offset_m.z()}});
  }
  if (prop) body.bones[0] = {.name = name, .id = id, .parent = -1};
  return body;
}

std::uint32_t packed(const Timecode& timecode) {
  std::uint32_t fields = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const int tens = timecode[3 * i] - '0', ones = timecode[3 * i + 1] - '0';
    if (tens < 0 || tens > 9 || ones < 0 || ones > 9) return 0;
    fields = fields << 8 | static_cast<std::uint32_t>(10 * tens + ones);
  }
  // Thousandths of a second are no frames.
  return timecode[8] == ':' ? fields : 0;
}

}  // namespace

std::uint64_t NatNetScene::ticks_at(std::int64_t time_ns) noexcept {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(time_ns, 0)) /
         (kNanosPerSecond / kClock_hz);
}

Result<> NatNetScene::set_stream(std::size_t place, const LiveStream* stream) {
  auto& body = bodies_[place];
  const bool was = body.has_value();
  body.reset();
  names_[place].clear();
  if (was) describe();
  if (stream == nullptr) return {};
  const auto& skeleton = stream->skeleton;
  const auto id = static_cast<std::int32_t>(place + 1);
  const bool prop = skeleton != nullptr && is_prop(*skeleton);
  const bool own = skeleton != nullptr && (prop || is_of_motive(*skeleton));
  const std::string name =
      distinct_name(own ? skeleton->name : stream->name, stream->name, place, names_);
  auto fit = TRY(Fit::make(skeleton, own, [&](double scale) {
    return natnet::skeleton_of(
        natnet::average_person(name, id, static_cast<float>(scale), has_fingers(*skeleton)));
  }));
  Body& made = body.emplace(std::move(fit), own);
  made.rate_hz = stream->rate_hz;
  made.described = describe_body(made.fit.skeleton(), name, id, prop);
  made.packet.id = id;
  for (const natnet::BoneDef& bone : made.described.bones) {
    made.packet.bones.push_back({.id = prop ? id : id << 16 | bone.id,
                                 .position_m = bone.offset_m,
                                 .rotation_xyzw = kIdentity});
  }
  describe();
  return {};
}

void NatNetScene::describe() {
  model_ = {};
  rate_hz_ = 0.0;
  for (const auto& body : bodies_) {
    if (!body) continue;
    model_.bodies.push_back(body->described);
    rate_hz_ = std::max(rate_hz_, body->rate_hz);
  }
  changed_ = true;
}

bool NatNetScene::take(std::size_t place, const Frame& frame) {
  auto& body = bodies_[place];
  if (!body) return false;
  const Frame& pose = body->fit.apply(frame);
  auto& bones = body->packet.bones;
  for (std::size_t j = 0; j < bones.size(); ++j) {
    bones[j].rotation_xyzw = pose.rotation_xyzw[j];
    bones[j].tracked = frame.quality != Quality::kStale && (!body->own || frame.valid[j]);
  }
  bones[0].position_m = pose.root_position_m;
  body->posed = true;
  advance(time_ns_, frame.header);
  if (begin_ns_ == kNoTime_ns) begin_ns_ = time_ns_;
  timecode_ = frame.timecode;
  return true;
}

const natnet::FramePacket& NatNetScene::next_frame(std::int64_t now_ns) {
  packet_.bodies_changed = std::exchange(changed_, false);
  ++packet_.number;
  packet_.timecode = packed(timecode_);
  packet_.timestamp_s = seconds(time_ns_ - begin_ns_);
  packet_.exposure_ticks = ticks_at(time_ns_);
  packet_.received_ticks = ticks_at(std::max(time_ns_, now_ns));
  packet_.sent_ticks = packet_.received_ticks;
  packet_.rigid_bodies.clear();
  std::size_t people = 0;
  for (const auto& body : bodies_) {
    if (!body || !body->posed) continue;
    if (!body->described.is_skeleton) {
      packet_.rigid_bodies.push_back(body->packet.bones[0]);
      continue;
    }
    // What is there is written over, so that a frame allocates nothing.
    if (people == packet_.skeletons.size()) packet_.skeletons.emplace_back();
    packet_.skeletons[people++] = body->packet;
  }
  packet_.skeletons.resize(people);
  return packet_;
}

}  // namespace posed::output

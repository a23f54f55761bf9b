#include "drivers/vmc/emulator.hpp"

#include <algorithm>

#include "drivers/emulate/motion.hpp"
#include "drivers/vmc/layout.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::vmc {
namespace {

constexpr float kHipHeight_m = 0.86F;

struct Rest {
  std::string_view bone;
  Vec3f offset_m;
};

// A person of 1.6 m in T-pose; the right side mirrors the left one.
constexpr std::array<Rest, 33> kRest{{{"Spine", {0.0F, 0.07F, 0.0F}},
                                      {"Chest", {0.0F, 0.12F, 0.0F}},
                                      {"UpperChest", {0.0F, 0.12F, 0.0F}},
                                      {"Neck", {0.0F, 0.14F, -0.01F}},
                                      {"Head", {0.0F, 0.08F, 0.01F}},
                                      {"LeftEye", {0.03F, 0.06F, 0.07F}},
                                      {"Jaw", {0.0F, 0.02F, 0.03F}},
                                      {"LeftShoulder", {0.03F, 0.1F, -0.01F}},
                                      {"LeftUpperArm", {0.1F, 0.0F, 0.0F}},
                                      {"LeftLowerArm", {0.24F, 0.0F, 0.0F}},
                                      {"LeftHand", {0.23F, 0.0F, 0.0F}},
                                      {"LeftThumbProximal", {0.02F, -0.01F, 0.02F}},
                                      {"LeftThumbIntermediate", {0.03F, 0.0F, 0.03F}},
                                      {"LeftThumbDistal", {0.02F, 0.0F, 0.02F}},
                                      {"LeftIndexProximal", {0.08F, 0.0F, 0.02F}},
                                      {"LeftIndexIntermediate", {0.035F, 0.0F, 0.0F}},
                                      {"LeftIndexDistal", {0.02F, 0.0F, 0.0F}},
                                      {"LeftMiddleProximal", {0.082F, 0.0F, 0.0F}},
                                      {"LeftMiddleIntermediate", {0.04F, 0.0F, 0.0F}},
                                      {"LeftMiddleDistal", {0.025F, 0.0F, 0.0F}},
                                      {"LeftRingProximal", {0.078F, 0.0F, -0.02F}},
                                      {"LeftRingIntermediate", {0.036F, 0.0F, 0.0F}},
                                      {"LeftRingDistal", {0.023F, 0.0F, 0.0F}},
                                      {"LeftLittleProximal", {0.07F, 0.0F, -0.035F}},
                                      {"LeftLittleIntermediate", {0.03F, 0.0F, 0.0F}},
                                      {"LeftLittleDistal", {0.018F, 0.0F, 0.0F}},
                                      {"LeftUpperLeg", {0.08F, -0.04F, 0.0F}},
                                      {"LeftLowerLeg", {0.0F, -0.37F, 0.0F}},
                                      {"LeftFoot", {0.0F, -0.38F, -0.02F}},
                                      {"LeftToes", {0.0F, -0.07F, 0.12F}},
                                      {"RightEye", {-0.03F, 0.06F, 0.07F}},
                                      {"RightShoulder", {-0.03F, 0.1F, -0.01F}},
                                      {"RightUpperLeg", {-0.08F, -0.04F, 0.0F}}}};

Vec3f rest_offset(std::string_view bone) {
  const auto found = std::ranges::find(kRest, bone, &Rest::bone);
  if (found != kRest.end()) return found->offset_m;
  if (!bone.starts_with("Right")) return {};
  const Vec3f left_m = rest_offset("Left" + std::string(bone.substr(5)));
  return {-left_m[0], left_m[1], left_m[2]};
}

std::shared_ptr<const Skeleton> rest_skeleton() {
  Described described;
  described.bones.set();
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    described.offset_m[bone] = rest_offset(bone_table()[bone].name);
  }
  std::array<std::byte, kMaxDescribed> room{};
  return make_layout(write_description(described, room)).value()->bodies.front().skeleton;
}

}  // namespace

VmcEmulator::VmcEmulator(double rate_hz, Packing packing)
    : skeleton_(rest_skeleton()),
      frames_(nanoseconds(1.0 / rate_hz)),
      writer_(std::make_unique<DatagramWriter>(packing)) {
  rotation_xyzw_.fill(kIdentity);
  frames_.start(0);
}

void VmcEmulator::pose(std::size_t body, const Frame& frame) {
  if (body != 0) return;
  posed_ = true;
  hips_m_ = frame.root_position_m;
  for (std::size_t j = 0; j < std::min<std::size_t>(kBoneCount, frame.joint_count); ++j) {
    rotation_xyzw_[j] = frame.valid[j] ? frame.rotation_xyzw[j] : Quatf{};
  }
}

std::int64_t VmcEmulator::next_due_ns() const {
  return sent_ < writer_->datagrams() ? frame_ns_ : frames_.due_ns();
}

void VmcEmulator::emit(std::int64_t now_ns, Bytes& out) {
  if (sent_ == writer_->datagrams()) {
    frame_ns_ = frames_.due_ns();
    frames_.step(now_ns);
    if (!posed_) move(seconds(frame_ns_));
    write_frame(seconds(frame_ns_));
    sent_ = 0;
  }
  const auto datagram = writer_->datagram(sent_++);
  out.insert(out.end(), datagram.begin(), datagram.end());
}

void VmcEmulator::move(double time_s) {
  const auto turn = [this](Bone bone, const Eigen::Quaterniond& rotation) {
    rotation_xyzw_[skeleton_->joint_of(bone)] = from_eigen(rotation);
  };
  hips_m_ = emulate::walk(time_s, kHipHeight_m, turn);
  const double look_rad = 0.2 * emulate::swing_rad(time_s, 0.5);
  for (const char* eye : {"LeftEye", "RightEye"}) {
    rotation_xyzw_[find_bone(eye)] = from_eigen(axis_rotation(Axis::kY, look_rad));
  }
}

void VmcEmulator::write_frame(double time_s) {
  writer_->start();
  if (status_.loaded) {
    writer_->root({}, kIdentity);
    for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
      if (left_out_[bone]) continue;
      Vec3f at_m = bone == kHips ? hips_m_ : rest_offset(bone_table()[bone].name);
      if (bone != kHips) std::ranges::for_each(at_m, [this](float& x_m) { x_m *= size_; });
      writer_->bone(bone, at_m, rotation_xyzw_[bone]);
    }
    writer_->device(ValueKind::kHeadSet, "HMD", {hips_m_[0], 2.0F * hips_m_[1], hips_m_[2]},
                    rotation_xyzw_[kHips]);
    writer_->device(ValueKind::kTracker, "LHR-0001", hips_m_, rotation_xyzw_[kHips]);
    // The pose says all, also what the face does: posed twice alike, it sends the same.
    const float smile = 0.5F + 0.5F * rotation_xyzw_[find_bone("LeftUpperLeg")][0];
    writer_->blend("Joy", smile);
    writer_->blend("Blink", 1.0F - smile);
    writer_->apply();
  }
  writer_->status(status_);
  writer_->time(static_cast<float>(time_s));
}

}  // namespace posed::drivers::vmc

#include "drivers/chain/emulator.hpp"

#include "drivers/emulate/motion.hpp"
#include "drivers/emulate/pace.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/message/skeleton_message.hpp"

namespace posed::drivers::chain {
namespace {

// The emulated machine has been running for an hour.
constexpr std::int64_t kBegan_ns = 3600 * kNanosPerSecond;
constexpr int kRightArm = 3;

Skeleton person() {
  Skeleton skeleton;
  skeleton.name = "emulated";
  const auto add = [&](const char* name, int parent, double x_m, double y_m) {
    Joint& joint = skeleton.joints.emplace_back();
    joint.name = name;
    joint.parent = parent;
    joint.offset_m = {x_m, y_m, 0.0};
  };
  add("Hips", -1, 0.0, 0.0);
  add("Spine", 0, 0.0, 0.2);
  add("Head", 1, 0.0, 0.5);
  add("RightArm", 1, -0.18, 0.4);
  add("RightForeArm", 3, -0.28, 0.0);
  skeleton.finish().value();
  return skeleton;
}

}  // namespace

UpstreamEmulator::UpstreamEmulator(const UpstreamInfo& info)
    : info_(info),
      skeleton_(person()),
      encoder_(info.stream),
      frames_(nanoseconds(1.0 / info.rate_hz)),
      skeletons_(kNanosPerSecond) {
  pose_.skeleton = skeleton_.id;
  pose_.joint_count = static_cast<std::uint16_t>(skeleton_.joints.size());
  pose_.rotation_xyzw.fill(kIdentity);
  pose_.valid.set();
  pose_.root_position_m = {0.0F, 0.93F, 0.0F};
  frames_.start(0);
  skeletons_.start(0);
}

void UpstreamEmulator::pose(std::size_t body, const Frame& frame) {
  if (body != 0) return;
  posed_ = true;
  const auto joints = std::min<std::size_t>(pose_.joint_count, frame.joint_count);
  for (std::size_t j = 0; j < joints; ++j) {
    pose_.rotation_xyzw[j] = frame.rotation_xyzw[j];
    pose_.valid[j] = frame.valid[j];
  }
  pose_.root_position_m = frame.root_position_m;
}

void UpstreamEmulator::emit(std::int64_t now_ns, Bytes& out) {
  Bytes chunk;
  if (skeletons_.due_ns() <= frames_.due_ns()) {
    skeletons_.step(now_ns);
    chunk = join_message(
        "skeleton/" + info_.stream,
        message::skeleton_message(info_.stream, skeleton_, info_.rate_hz).SerializeAsString());
  } else {
    const double time_s = seconds(frames_.due_ns());
    pose_.header.arrival_ns = kBegan_ns + frames_.due_ns();
    pose_.timecode = to_timecode(emulate::timecode_at(frames_.due_ns()));
    frames_.step(now_ns);
    ++pose_.header.sequence;
    if (!posed_) {
      const double swing_rad = emulate::swing_rad(time_s, 0.4);
      pose_.rotation_xyzw[kRightArm] = from_eigen(axis_rotation(Axis::kZ, -0.6 + swing_rad));
    }
    chunk = join_message("pose/" + info_.stream, encoder_.encode(pose_).SerializeAsString());
  }
  out.insert(out.end(), chunk.begin(), chunk.end());
}

}  // namespace posed::drivers::chain

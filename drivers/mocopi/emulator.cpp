#include "drivers/mocopi/emulator.hpp"

#include <algorithm>

#include "drivers/emulate/motion.hpp"
#include "drivers/mocopi/encode.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::mocopi {
namespace {

constexpr std::int64_t kSkeletonEvery_ns = 2 * kNanosPerSecond;
constexpr double kBegan_s = 1.7e9;  // Unix time of the first frame
constexpr std::uint16_t kLeftUpArm = 12, kRightUpArm = 16, kRightLowArm = 17;

}  // namespace

MocopiEmulator::MocopiEmulator(double rate_hz)
    : bones_(average_bones(1.0F)),
      pose_(bones_),
      frames_(nanoseconds(1.0 / rate_hz)),
      skeletons_(kSkeletonEvery_ns) {
  Datagram datagram;
  const auto bytes = encode_skeleton(bones_);
  static_cast<void>(decode_datagram(bytes, datagram));
  layout_ = make_layout(datagram.content).value();
  frames_.start(0);
  skeletons_.start(0);
}

const Skeleton* MocopiEmulator::skeleton(std::size_t body) const {
  return body == 0 ? layout_->bodies[0].skeleton.get() : nullptr;
}

void MocopiEmulator::pose(std::size_t body, const Frame& frame) {
  if (body != 0) return;
  posed_ = true;
  const auto& ids = static_cast<const MocopiLayout&>(*layout_).id;
  for (std::size_t j = 0; j < std::min<std::size_t>(ids.size(), frame.joint_count); ++j) {
    pose_[ids[j]].transform.rotation_xyzw = frame.valid[j] ? frame.rotation_xyzw[j] : Quatf{};
  }
  pose_[0].transform.position_m = frame.root_position_m;
}

void MocopiEmulator::emit(std::int64_t now_ns, Bytes& out) {
  Bytes bytes;
  if (skeletons_.due_ns() <= frames_.due_ns()) {
    skeletons_.step(now_ns);
    bytes = encode_skeleton(bones_);
  } else {
    const double time_s = seconds(frames_.due_ns());
    frames_.step(now_ns);
    if (!posed_) {
      const double swing = emulate::swing_rad(time_s, 0.4);
      const auto turn = [this](std::uint16_t bone, double angle_rad) {
        pose_[bone].transform.rotation_xyzw = from_eigen(axis_rotation(Axis::kZ, angle_rad));
      };
      turn(kLeftUpArm, -1.3);
      turn(kRightUpArm, -0.6);
      turn(kRightLowArm, -0.9 + swing);
    }
    bytes = encode_frame(number_++, time_s, kBegan_s + time_s, pose_);
  }
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace posed::drivers::mocopi

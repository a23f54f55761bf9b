// Emulates a VMC performer: an avatar with all 55 bones that walks, blinks and smiles, a head set
// and a tracker at its hips.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "drivers/emulate/pace.hpp"
#include "drivers/emulator.hpp"
#include "drivers/vmc/bones.hpp"
#include "drivers/vmc/messages.hpp"

namespace posed::drivers::vmc {

class VmcEmulator final : public Emulator {
 public:
  VmcEmulator(double rate_hz, Packing packing);

  [[nodiscard]] const Skeleton* skeleton(std::size_t body) const override {
    return body == 0 ? skeleton_.get() : nullptr;
  }
  void pose(std::size_t body, const Frame& frame) override;
  [[nodiscard]] std::int64_t next_due_ns() const override;
  // The next datagram of a frame, in the protocol's usual order: root, bones, devices, blend
  // shapes, status and time.
  void emit(std::int64_t now_ns, Bytes& out) override;

  // What it says from now on: a model that is not loaded has no bones.
  void set_status(const Status& status) { status_ = status; }
  // Bones that its avatar does not have, and its size.
  void leave_out(std::size_t bone) { left_out_.set(bone); }
  void set_size(float size) { size_ = size; }

 private:
  void move(double time_s);
  void write_frame(double time_s);

  std::shared_ptr<const Skeleton> skeleton_;
  std::array<Quatf, kBoneCount> rotation_xyzw_{};  // [bone]
  Vec3f hips_m_{};
  bool posed_ = false;
  Status status_;
  std::bitset<kBoneCount> left_out_;
  float size_ = 1.0F;
  emulate::Pace frames_;
  std::int64_t frame_ns_ = 0;  // of the frame that is being sent
  std::unique_ptr<DatagramWriter> writer_;
  std::size_t sent_ = 0;  // datagrams of it
};

}  // namespace posed::drivers::vmc

// Decodes the datagrams of a VMC performer: collects the bones of a frame until FrameEnd says that
// it is complete, and describes the performer itself.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/active_time.hpp"
#include "drivers/driver.hpp"
#include "drivers/vmc/describer.hpp"
#include "drivers/vmc/frame_end.hpp"
#include "drivers/vmc/layout.hpp"
#include "drivers/vmc/osc.hpp"
#include "drivers/vmc/sender_clock.hpp"
#include "drivers/vmc/values.hpp"

namespace posed::drivers::vmc {

class VmcDecoder final : public LayoutDecoder<VmcLayout> {
 public:
  VmcDecoder() noexcept {
    rotation_xyzw_.fill(kIdentity);
    keeps_until_ns_.fill(kNoTime_ns);
  }

  // Takes one datagram per call.
  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

  // Takes what make_layout made.
  RT_SAFE void use(const SourceLayout& layout) noexcept override {
    LayoutDecoder::use(layout);
    values_.use(*layout_);
  }

 private:
  // The messages that a datagram carries, before any of them is used.
  struct Survey {
    bool any = false;     // message
    bool of_vmc = false;  // at least one
    FrameEnd::Received received;
    Outcome time = Outcome::kOk;
  };
  [[nodiscard]] Survey survey(std::span<const std::byte> packet) noexcept;
  [[nodiscard]] std::size_t bone_of(std::string_view name) const noexcept;
  [[nodiscard]] Outcome accept_packet(std::span<const std::byte> packet, Sink& sink) noexcept;
  // Each takes the arguments of one message; false if they are wrong.
  [[nodiscard]] bool accept_message(const OscMessage& message) noexcept;
  [[nodiscard]] bool accept_bone(OscArguments& arguments) noexcept;
  [[nodiscard]] bool accept_root(OscArguments& arguments) noexcept;
  [[nodiscard]] bool accept_blend(OscArguments& arguments) noexcept;
  [[nodiscard]] bool accept_device(ValueKind kind, OscArguments& arguments) noexcept;
  [[nodiscard]] bool accept_status(OscArguments& arguments) noexcept;
  [[nodiscard]] bool accept_avatar(OscArguments& arguments) noexcept;
  void end_frame(std::int64_t device_ns, Sink& sink) noexcept;
  [[nodiscard]] bool emit_frame(std::int64_t device_ns, Sink& sink) noexcept;
  void emit_sample(Sink& sink) noexcept;
  void note(Outcome outcome) noexcept {
    if (outcome != Outcome::kOk) worst_ = outcome;
  }

  FrameEnd end_;
  SenderClock clock_;
  bool has_vrm1_names_ = false;
  Values values_;
  Describer describer_;
  ActiveTime active_time_;
  std::int64_t arrival_ns_ = 0;       // of the datagram in hand, without pauses
  Outcome worst_ = Outcome::kOk;      // in it
  bool ended_ = false;                // a frame did in it
  std::bitset<kBoneCount> received_;  // bones of it
  std::bitset<kBoneCount> set_;       // bones of the frame so far
  bool applied_ = false;              // /VMC/Ext/Blend/Apply came since the last sample
  // A bone that is not in a frame may be lost. One that is missing again is left out by its sender,
  // because it did not turn: until then it keeps its rotation.
  std::bitset<kBoneCount> left_out_;
  std::array<std::int64_t, kBoneCount> keeps_until_ns_{};
  // The last values received, in posed's axes.
  std::array<Vec3f, kBoneCount> position_m_{};     // [bone], relative to the parent
  std::array<Quatf, kBoneCount> rotation_xyzw_{};  // [bone], relative to the parent
  Vec3f root_m_{};
  Quatf root_xyzw_ = kIdentity;
  bool root_seen_ = false;
  bool loaded_ = true, tracking_ = true;  // until the sender says something else
};

}  // namespace posed::drivers::vmc

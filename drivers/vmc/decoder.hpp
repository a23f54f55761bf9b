// Decodes the datagrams of a VMC performer: collects the bones of a frame until FrameEnd says that
// it is complete, and describes the performer itself.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/active_time.hpp"
#include "drivers/driver.hpp"
#include "drivers/vmc/bones.hpp"
#include "drivers/vmc/layout.hpp"
#include "drivers/vmc/osc.hpp"
#include "drivers/vmc/protocol.hpp"
#include "drivers/vmc/values.hpp"
#include "proto/frame/sink.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers::vmc {

// When the VMC performer has changed, and its description. The bones that were sent within a second
// and their positions are its skeleton; the names of its blend shapes and devices are its values.
// RT-safe.
class Describer {
 public:
  // The bones that an ended frame set, and all positions [bone].
  void frame(const std::bitset<kBoneCount>& bones, const std::array<Vec3f, kBoneCount>& position_m,
             std::int64_t arrival_ns) noexcept;
  // Sets the name that the sender gives its avatar. It is for people, so it alone makes no new
  // description.
  void title(std::string_view text) noexcept;

  // True when nothing has come for so long that the performer is gone.
  [[nodiscard]] bool is_gone(const Values& values, std::int64_t now_ns) const noexcept;

  // Describes the performer if it has changed and the change has lasted for some frames. Call it
  // after each frame and sample, and while none come.
  void update(Values& values, std::int64_t now_ns, Sink& sink) noexcept;

 private:
  static constexpr std::int64_t kGone_ns = kNanosPerSecond;
  static constexpr std::int64_t kBetween_ns = kNanosPerSecond / 2;  // descriptions
  // Between descriptions that only moved bones: doubled each time up to this, because each one
  // begins the stream again, and some avatars stretch.
  static constexpr std::int64_t kMaxInterval_ns = 64 * kNanosPerSecond;
  static constexpr float kMoved_m = 0.005F;
  static constexpr int kSteady = 2;  // frames without a new bone or value

  void forget_bones(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool has_moved() const noexcept;
  void describe(const Values& values, std::int64_t now_ns, Sink& sink) noexcept;

  std::bitset<kBoneCount> bones_;
  std::array<std::int64_t, kBoneCount> last_ns_{};
  std::array<Vec3f, kBoneCount> offset_m_{};
  std::array<char, kMaxVmcName> title_{};
  std::size_t title_size_ = 0;
  bool grown_ = false;       // a bone has come since the last update
  bool values_new_ = false;  // a value has come since the last description
  int steady_ = 0;           // updates without a new bone or value
  Described described_;      // last; its texts are not used
  bool there_ = false;       // the last description has a performer
  std::int64_t described_ns_ = kNoTime_ns;
  std::int64_t between_moves_ns_ = kBetween_ns;
  std::array<std::byte, kMaxDescribed> bytes_{};
};

// The messages that can end a frame: a bone's message (its index), /VMC/Ext/OK and /VMC/Ext/T.
inline constexpr std::size_t kOkMessage = kBoneCount;
inline constexpr std::size_t kTimeMessage = kBoneCount + 1;
inline constexpr std::size_t kEndMessages = kBoneCount + 2;

// Learns which message ends a frame of a VMC sender. The protocol does not say: senders put a frame
// into one bundle, into several, or into one datagram per message, in any order, with or without
// status and time. What they share is that they pause between frames.
//
// So a frame ends with the datagram that carries a certain message, at first the time, which ends
// the frames of the protocol's own sender and of most others. Two observations change that message:
//
//   - A bone came again although the frame had not ended. After the second time within four frames
//     the message before it is the end: the sender does not send the expected one with each frame.
//   - In three frames in a row the longest pause followed another message: that one is the end.
//
// Only what came counts, so the same datagrams at the same times always give the same frames.
// RT-safe.
class FrameEnd {
 public:
  // Those messages that a datagram carried.
  struct Received {
    std::bitset<kEndMessages> messages;
    std::size_t last = kEndMessages;  // none

    void add(std::size_t message) noexcept {
      messages.set(message);
      last = message;
    }
  };

  // A datagram with such messages is over. True when a frame, of which there is something if
  // `open`, ends with it.
  [[nodiscard]] bool ends(const Received& received, std::int64_t arrival_ns, bool open) noexcept {
    if (received.last == kEndMessages) return false;
    if (before_ != kEndMessages && arrival_ns - before_ns_ > longest_ns_) {
      longest_ns_ = arrival_ns - before_ns_;
      before_longest_ = before_;
    }
    before_ = received.last;
    before_ns_ = arrival_ns;
    if (!open || !received.messages[end_]) return false;
    misses_ = std::max(0, misses_ - 1);
    compare_pauses();
    return true;
  }

  // A bone came again before the frame's end; called before the datagram with it is over.
  void missed() noexcept {
    misses_ += kMiss;
    if (misses_ > kMaxMisses && before_ != kEndMessages) be(before_);
    forget_pauses();
  }

 private:
  static constexpr int kMiss = 2;
  static constexpr int kMaxMisses = 3;
  static constexpr int kAgree = 3;  // frames

  void be(std::size_t message) noexcept {
    end_ = message;
    misses_ = agreed_ = 0;
  }
  void compare_pauses() noexcept {
    if (before_longest_ == end_ || before_longest_ == kEndMessages) {
      agreed_ = 0;
    } else if (before_longest_ != candidate_) {
      candidate_ = before_longest_;
      agreed_ = 1;
    } else if (++agreed_ == kAgree) {
      be(candidate_);
    }
    forget_pauses();
  }
  void forget_pauses() noexcept {
    longest_ns_ = 0;
    before_longest_ = kEndMessages;
  }

  std::size_t end_ = kTimeMessage;
  int misses_ = 0;
  std::size_t before_ = kEndMessages;  // the last message of the datagram before
  std::int64_t before_ns_ = 0;
  std::int64_t longest_ns_ = 0;  // pause since the last end
  std::size_t before_longest_ = kEndMessages;
  std::size_t candidate_ = kEndMessages;
  int agreed_ = 0;  // frames in a row for which it was the end
};

// The device time from /VMC/Ext/T, the sender's time in seconds as a 32-bit float. Such a float has
// steps of 0.5 ms after one hour, 2 ms after five and 4 ms after ten. From kFinest_s on (18 hours;
// some senders send the time of day) it is not used as a clock. RT-safe.
class SenderClock {
 public:
  // kLate: a newer time came before it, so the datagram was overtaken by another. kOutOfRange: no
  // time. kOk: taken, or too coarse to be used.
  [[nodiscard]] Outcome accept(float time_s) noexcept {
    if (!std::isfinite(time_s) || time_s < 0.0F) return Outcome::kOutOfRange;
    if (time_s >= kFinest_s) {
      // One such value may be damaged; many are a sender that has no usable clock.
      if (coarse_ < kMaxCoarse) ++coarse_;
      if (coarse_ == kMaxCoarse) seen_ = false;
      return Outcome::kOk;
    }
    coarse_ = 0;
    const double step_s = static_cast<double>(time_s) - static_cast<double>(newest_s_);
    const bool late = seen_ && step_s < 0.0 && step_s > -kLate_s;
    late_ = late ? late_ + 1 : 0;
    if (late && late_ < kMaxLate) return Outcome::kLate;
    // A larger step back is a sender that started again: time continues from where it was.
    if (seen_ && step_s > 0.0) ticks_ns_ = std::min(ticks_ns_ + nanoseconds(step_s), kLast_ns);
    seen_ = true;
    late_ = 0;
    newest_s_ = time_s;
    return Outcome::kOk;
  }

  // Since the first time; kNoTime_ns when there is none. Never decreases while it is there.
  [[nodiscard]] std::int64_t device_ns() const noexcept { return seen_ ? ticks_ns_ : kNoTime_ns; }

 private:
  static constexpr float kFinest_s = 65536.0F;
  static constexpr std::int64_t kLast_ns = INT64_MAX / 2;
  static constexpr double kLate_s = 0.1;  // no network holds a datagram back for longer
  static constexpr int kMaxLate = 8;      // in a row; then the sender's time has gone back
  static constexpr int kMaxCoarse = 8;    // in a row

  float newest_s_ = 0.0F;
  std::int64_t ticks_ns_ = 0;
  bool seen_ = false;
  int late_ = 0;
  int coarse_ = 0;
};

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

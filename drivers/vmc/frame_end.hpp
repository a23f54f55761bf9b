// FrameEnd: learns which message ends a frame of a VMC sender. The protocol does not say: senders
// put a frame into one bundle, into several, or into one datagram per message, in any order, with
// or without status and time. What they share is that they pause between frames.
//
// So a frame ends with the datagram that carries a certain message, at first the time, which ends
// the frames of the protocol's own sender and of most others. Two observations change that message:
//
//   - A bone came again although the frame had not ended. After the second time within four frames
//     the message before it is the end: the sender does not send the expected one with each frame.
//   - In three frames in a row the longest pause followed another message: that one is the end.
//
// Only what came counts, so the same datagrams at the same times always give the same frames.
#pragma once

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdint>

#include "drivers/vmc/bones.hpp"

namespace posed::drivers::vmc {

// The messages that can end a frame: a bone's message (its index), /VMC/Ext/OK and /VMC/Ext/T.
inline constexpr std::size_t kOkMessage = kBoneCount;
inline constexpr std::size_t kTimeMessage = kBoneCount + 1;
inline constexpr std::size_t kEndMessages = kBoneCount + 2;

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

}  // namespace posed::drivers::vmc

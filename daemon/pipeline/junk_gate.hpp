// JunkGate: how much rubbish of a source a recording takes. Up to kJunkPerSecond of
// bytes that the decoder had no use for are recorded, so that a log shows what came. Beyond that
// only those are heard of whom the decoder has lately used something: what is not recorded must not
// be decoded either, or a replay would not do the same. A stream of bytes is heard as a whole or
// not at all: without its middle it could be read as other values. RT-safe; one thread.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "proto/frame/rt_safe.hpp"
#include "proto/frame/time.hpp"

namespace posed::pipeline {

class JunkGate {
 public:
  static constexpr std::int64_t kJunkPerSecond = 500'000;  // bytes, and the most that is saved up
  // Bytes that a link may have brought in vain, beyond what is saved up, before it must end.
  static constexpr std::int64_t kMaxOwed = 6 * kJunkPerSecond;
  // Bytes that a new link may bring in vain when all that was used up before it came: its first
  // message tells a device that reconnects from one more link of a flood.
  static constexpr std::int64_t kFirstBytes = 64 * 1024;
  static constexpr std::int64_t kKnownFor_ns = 2 * kNanosPerSecond;

  // Whether the chunk is to be recorded and decoded. `sender`: as in drivers::Chunk; 0 always is.
  // `cost`: its bytes in the log; so beside large rubbish a device that is new is soon heard.
  RT_SAFE [[nodiscard]] bool admits(std::uint64_t sender, std::int64_t cost,
                                    std::int64_t now_ns) noexcept {
    refill(now_ns);
    return sender == 0 || left_ >= cost || is_known(sender, now_ns);
  }

  // Whether a chunk that is part of a link (drivers::Chunk::kLink) is to be recorded and decoded;
  // if not, the link must end.
  RT_SAFE [[nodiscard]] bool admits_link(std::uint64_t sender, std::int64_t now_ns) noexcept {
    refill(now_ns);
    if (is_known(sender, now_ns)) return true;
    if (sender != link_) {
      const std::int64_t floor = left_ >= 0 ? -kMaxOwed : left_ - kFirstBytes;
      if (floor < -kLowest) return false;
      link_ = sender;
      link_floor_ = floor;
    }
    return left_ >= link_floor_;
  }

  // What became of a chunk that was admitted.
  RT_SAFE void decoded(std::uint64_t sender, bool used, std::int64_t cost,
                       std::int64_t now_ns) noexcept {
    if (sender == 0) return;
    if (used) {
      // The rest of a long message came just before its end.
      if (sender == link_) left_ = std::max<std::int64_t>(left_, 0);
      return remember(sender, now_ns);
    }
    left_ = std::max(left_ - cost, sender == link_ ? -kLowest : -kJunkPerSecond);
  }

 private:
  static constexpr std::int64_t kLowest = 2 * kMaxOwed;

  struct Known {
    std::uint64_t sender = 0;
    std::int64_t used_ns = 0;
  };

  RT_SAFE void refill(std::int64_t now_ns) noexcept {
    constexpr std::int64_t kMaxPassed_ns = 3 * kMaxOwed / kJunkPerSecond * kNanosPerSecond;
    const std::int64_t passed_ns = std::clamp<std::int64_t>(now_ns - filled_ns_, 0, kMaxPassed_ns);
    filled_ns_ = std::max(filled_ns_, now_ns);
    left_ = std::min(left_ + passed_ns * kJunkPerSecond / kNanosPerSecond, kJunkPerSecond);
  }
  RT_SAFE [[nodiscard]] bool is_known(std::uint64_t sender, std::int64_t now_ns) const noexcept {
    const auto known = std::ranges::find(known_, sender, &Known::sender);
    return known != known_.end() && now_ns - known->used_ns <= kKnownFor_ns;
  }
  RT_SAFE void remember(std::uint64_t sender, std::int64_t now_ns) noexcept {
    auto place = std::ranges::find(known_, sender, &Known::sender);
    if (place == known_.end()) place = std::ranges::min_element(known_, {}, &Known::used_ns);
    *place = {sender, now_ns};
  }

  // Bytes of rubbish that may come; below 0 by those of known senders.
  std::int64_t left_ = kJunkPerSecond;
  std::int64_t filled_ns_ = 0;
  std::uint64_t link_ = 0;       // the one that was let in last
  std::int64_t link_floor_ = 0;  // the least of left_ at which it is heard
  std::array<Known, 8> known_{};
};

}  // namespace posed::pipeline

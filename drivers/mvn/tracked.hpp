// Tracked: what the decoder keeps about one character between its datagrams. RT-safe.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "drivers/datagram_order.hpp"
#include "drivers/mvn/layout.hpp"
#include "drivers/mvn/protocol.hpp"
#include "drivers/mvn/values.hpp"
#include "drivers/unrolled_counter.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers::mvn {

// How long a character may be silent before it counts as gone, how long to wait for a character's
// name and scale, and how long a better type of pose may be silent before a worse one counts.
inline constexpr std::int64_t kPatience_ns = kNanosPerSecond;

// Puts a sample together that MVN has split into several datagrams, in any order. Fixed size,
// RT-safe.
class Assembly {
 public:
  using Buffer = std::array<std::byte, kMaxPoseBytes>;

  [[nodiscard]] bool is_open() const noexcept { return open_; }
  [[nodiscard]] std::uint32_t sample() const noexcept { return sample_; }

  void begin(std::uint32_t sample) noexcept {
    open_ = true;
    sample_ = sample;
    used_ = 0;
    parts_ = 0;
    came_.reset();
  }
  void close() noexcept { open_ = false; }

  // kDuplicate: the part came before. kOutOfRange: the parts contradict each other, or no character
  // has so many segments.
  [[nodiscard]] Outcome add(const Datagram& datagram) noexcept {
    const std::size_t part = datagram.head.part;
    const std::size_t bytes = datagram.payload.size();
    if (part >= kMaxItems || bytes > buffer_.size() - used_) return Outcome::kOutOfRange;
    if (came_[part]) return Outcome::kDuplicate;
    const bool beyond = parts_ != 0 && part >= parts_;
    if (beyond || (datagram.head.last && (came_ >> part).any())) return Outcome::kOutOfRange;
    came_.set(part);
    place_[part] = {used_, bytes};
    std::ranges::copy(datagram.payload, buffer_.begin() + static_cast<std::ptrdiff_t>(used_));
    used_ += bytes;
    if (datagram.head.last) parts_ = part + 1;
    return Outcome::kOk;
  }

  [[nodiscard]] bool is_whole() const noexcept { return parts_ != 0 && came_.count() == parts_; }

  // The payload of the whole sample, in `to`.
  [[nodiscard]] std::span<const std::byte> gather(Buffer& to) const noexcept {
    std::size_t size = 0;
    for (std::size_t part = 0; part < parts_; ++part) {
      const auto [offset, bytes] = place_[part];
      std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(offset), bytes,
                  to.begin() + static_cast<std::ptrdiff_t>(size));
      size += bytes;
    }
    return std::span(to).first(size);
  }

 private:
  struct Place {
    std::size_t offset = 0;
    std::size_t bytes = 0;
  };
  Buffer buffer_{};
  std::array<Place, kMaxItems> place_{};  // [part]
  std::bitset<kMaxItems> came_;           // [part]
  std::size_t used_ = 0;
  std::size_t parts_ = 0;  // 0 until the last one has come
  std::uint32_t sample_ = 0;
  bool open_ = false;
};

// A character's device time from the time codes of its datagrams [ms]. RT-safe.
class TimeCode {
 public:
  [[nodiscard]] bool has_begun() const noexcept { return begun_; }

  // The first time code. Characters of one MVN share its clock: `other`, when it has one, says
  // which time belongs to a time code near this one.
  void begin(std::uint32_t code_ms, const TimeCode* other) noexcept {
    *this = TimeCode();
    begun_ = true;
    newest_ms_ = code_ms;
    static_cast<void>(counter_.to(code_ms));
    if (other == nullptr) return;
    const auto apart_ms = static_cast<std::int32_t>(code_ms - other->newest_ms_);
    const bool same_clock = std::abs(std::int64_t{apart_ms}) < kNear_ms;
    time_ms_ = other->time_ms_ + (same_clock ? apart_ms : 0);
    moves_ = same_clock && other->moves_;
  }

  // Never decreases. kNoTime_ns until the time code has changed: without a recording MVN's clock
  // may stand.
  [[nodiscard]] std::int64_t to_ns(std::uint32_t code_ms) noexcept {
    const std::uint32_t behind_ms = newest_ms_ - code_ms;
    // A datagram of another type that came late does not set the clock back.
    if (behind_ms >= kNear_ms) {
      const std::int64_t before_ms = ticks_ms_;
      ticks_ms_ = counter_.to(code_ms).ticks;
      const std::int64_t step_ms = ticks_ms_ - before_ms;
      // A longer step is none: MVN has restarted, or the value is damaged.
      if (step_ms <= kMaxGap_ms) time_ms_ = std::min(time_ms_ + step_ms, kLast_ms);
      newest_ms_ = code_ms;
      moves_ = true;
    }
    return moves_ ? time_ms_ * 1'000'000 : kNoTime_ns;
  }

 private:
  static constexpr std::uint32_t kNear_ms = 1000;
  static constexpr std::int64_t kMaxGap_ms = 3'600'000;
  static constexpr std::int64_t kLast_ms = INT64_MAX / 2 / 1'000'000;

  UnrolledCounter counter_{32};
  std::uint32_t newest_ms_ = 0;
  std::int64_t ticks_ms_ = 0;
  std::int64_t time_ms_ = 0;
  bool begun_ = false;
  bool moves_ = false;
};

class Tracked {
 public:
  bool known = false;      // the slot is in use
  bool described = false;  // in the newest description
  bool changed = false;    // since then
  std::int64_t first_ns = 0;
  std::int64_t received_ns = 0;  // time of the last pose, or of any packet before the first pose
  TimeCode clock;
  std::array<PartOrder, kValueGroups> value_order;  // [group]
  Character character;                              // as it is described

  void begin(std::uint8_t id, std::int64_t now_ns) noexcept;

  // Returns whether this type of pose is the one to use, of those that come for every sample.
  [[nodiscard]] bool prefers(const Head& head, std::int64_t now_ns) noexcept;
  // Orders a part of a sample and puts it to the others. `whole`: nothing is missing any more;
  // `items` is the payload then. `lost`: an earlier sample stays without a part of it.
  struct Part {
    Outcome outcome = Outcome::kOk;
    bool whole = false;
    bool lost = false;
    std::span<const std::byte> items;
  };
  [[nodiscard]] Part accept_part(const Datagram& datagram, Assembly::Buffer& to) noexcept;

  void set_name(std::string_view name) noexcept;
  void set_scale(const std::array<Vec3f, kBodySegments>& position_m) noexcept;
  // Learns the proportions from a pose, while no better source has them.
  void look_at(const CharacterPose& pose, std::int64_t now_ns) noexcept;

  // Returns whether a description should hold it: not gone, and either complete or awaited long
  // enough.
  [[nodiscard]] bool belongs(std::int64_t now_ns) const noexcept;

 private:
  using Offsets = std::array<Vec3f, kSegments>;
  void accept_offsets(const Offsets& offset_m, std::size_t from, std::size_t to) noexcept;
  [[nodiscard]] double farthest_m(const Offsets& offset_m, std::size_t from,
                                  std::size_t to) const noexcept;

  DatagramOrder order_{32};
  Assembly assembly_;
  Type type_ = Type::kEuler;  // of its poses
  bool posed_ = false;        // a part of a pose has come
  bool looked_ = false;       // a whole one has
  bool other_done_ = false;   // the sample `done_` came from another type
  std::uint32_t done_ = 0;    // the newest sample accepted
  std::int64_t type_ns_ = 0;  // arrival of the newest pose of that type
  bool named_ = false;
  bool scaled_ = false;    // type 13 came
  bool has_body_ = false;  // the body's proportions are known
  bool differs_ = false;   // the last look found other proportions
  std::int64_t look_ns_ = 0;
};

}  // namespace posed::drivers::mvn

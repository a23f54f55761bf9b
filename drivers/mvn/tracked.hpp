// Tracked: what the decoder keeps about one character between its datagrams. RT-safe.
#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/datagram_order.hpp"
#include "drivers/mvn/assembly.hpp"
#include "drivers/mvn/layout.hpp"
#include "drivers/mvn/protocol.hpp"
#include "drivers/mvn/time_code.hpp"
#include "drivers/mvn/values.hpp"

namespace posed::drivers::mvn {

// How long a character may be silent before it counts as gone, how long to wait for a character's
// name and scale, and how long a better type of pose may be silent before a worse one counts.
inline constexpr std::int64_t kPatience_ns = kNanosPerSecond;

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

// The values that MVN sends about a character beside its pose (types 20 to 24), as the named values
// of its samples. Each of these items names its segment, so a datagram is read without the other
// parts of its sample. Values of the body's 23 segments are handed on, those of props and fingers
// are not.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>

#include "drivers/datagram_order.hpp"
#include "drivers/driver.hpp"
#include "drivers/mvn/protocol.hpp"

namespace posed::drivers::mvn {

// Values that come in one datagram. The numbers are those in the description of the characters.
enum class ValueGroup : std::uint8_t {
  kCentreOfMass,
  kJointAngles,
  kLinear,
  kAngular,
  kTrackers,
  kLongTrackers,  // type 23 of newer versions: also what the sensors measured
  kCount
};
inline constexpr std::size_t kValueGroups = static_cast<std::size_t>(ValueGroup::kCount);
using ValueGroups = std::bitset<kValueGroups>;  // [group], those that a character has sent

// Numbers that an item may have behind its ids: those of a tracker of newer versions.
inline constexpr std::size_t kMaxItemValues = 16;
inline constexpr std::size_t kMaxGroupValues = kBodySegments * kMaxItemValues;

// The values of one datagram, of a group as a whole: those that it did not tell are not valid.
struct GroupValues {
  ValueGroup group = ValueGroup::kCentreOfMass;
  std::array<float, kMaxGroupValues> value{};  // in posed's units and axes
  std::bitset<kMaxGroupValues> valid;
};

// The datagram is one of types 20 to 24 as decode_datagram passes it. kOutOfRange: a segment that
// no character has or that comes twice, or a number that is no position, rotation or angle; no
// value counts then.
RT_SAFE [[nodiscard]] Outcome decode_values(const Datagram& datagram, GroupValues& values) noexcept;

RT_SAFE [[nodiscard]] std::size_t value_count(ValueGroup group) noexcept;

// The place of each group's values in the samples of a character that sends these groups. They
// stand in the order of the groups; one that no longer fits into kMaxSampleValues is left out as a
// whole.
struct ValuePlaces {
  static constexpr std::size_t kNone = ~std::size_t{0};
  std::array<std::size_t, kValueGroups> begin{};  // [group], kNone: not in the samples
  std::size_t count = 0;                          // of all values
};
RT_SAFE [[nodiscard]] ValuePlaces place_values(ValueGroups groups) noexcept;

// "LeftForeArm_velocity_x" and its unit. Cold.
[[nodiscard]] SampleLayout name_values(ValueGroups groups);

// Decides which datagrams of one type are new; the parts of one sample have the same number.
class PartOrder {
 public:
  // Returns what DatagramOrder::accept returns.
  RT_SAFE [[nodiscard]] Outcome accept(const Head& head) noexcept {
    if (!came_.any() || head.sample != sample_) {
      const Outcome outcome = samples_.accept(head.sample);
      if (outcome != Outcome::kOk) return outcome;
      sample_ = head.sample;
      came_.reset();
    }
    if (came_[head.part]) return Outcome::kDuplicate;
    came_.set(head.part);
    return Outcome::kOk;
  }

 private:
  DatagramOrder samples_{32};
  std::uint32_t sample_ = 0;
  std::bitset<128> came_;  // [part]
};

}  // namespace posed::drivers::mvn

// HandTracks: which hand of a message is one of the message before, and of what side it is. A hand
// does not change its side while it is seen, but trackers take it for the other one in single
// pictures, and for seconds: a fist with its palm to the camera looks like the back of the other
// hand. So many messages decide, and pictures that contradict them are left out for a second.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/landmarks/protocol.hpp"

namespace posed::drivers::landmarks {

// The same messages and times give the same sides.
class HandTracks {
 public:
  // Sets side, shape and doubtful of the hands that are seen, no two of one side. Of a hand that
  // comes twice, the less sure one becomes kOutOfRange. `now_ns` never decreases.
  RT_SAFE void follow(Message& message, std::int64_t now_ns) noexcept;

  // Whether a hand of this side was read within the last second.
  RT_SAFE [[nodiscard]] bool knows(Side side, std::int64_t now_ns) const noexcept;

 private:
  struct Track {
    Vec3f wrist_m{};
    double votes_s = 0.0;  // for so long it was a right hand, less the time as a left one
    Side side = Side::kRight;
    std::int64_t seen_ns = kNoTime_ns;  // kNoTime_ns: there is none
    std::int64_t read_ns = kNoTime_ns;  // the last picture that was not doubtful
  };

  [[nodiscard]] static double cost(const Track& track, const TrackedHand& hand,
                                   std::int64_t now_ns) noexcept;
  static void vote(Track& track, const TrackedHand& hand, std::int64_t now_ns) noexcept;
  static void judge(Track& track, TrackedHand& hand, std::int64_t now_ns) noexcept;

  std::array<Track, kMaxHands> tracks_;
};

// The side of which the points are, whatever the tracker calls it: digits bend towards the palm.
// `otherwise` if they are straight.
RT_SAFE [[nodiscard]] Side shape_of(const Landmarks& point_m, Side otherwise) noexcept;

}  // namespace posed::drivers::landmarks

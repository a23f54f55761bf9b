// The messages of a hand tracker: JSON, one object a UDP datagram, with or without a line end, or
// one a line over TCP. The format is posed's own, so that any program with landmarks of hands can
// send them: a page with a webcam, OpenXR, Leap Motion, a script. No I/O here;
// drivers/landmarks/README.md has an example.
//
//   {"posed": "landmarks", "version": 1, "time_ns": 1234567890,
//    "hands": [{"side": "right", "score": 0.97, "points": [x0, y0, z0, ... x20, y20, z20]}]}
//
//    time_ns   when the picture was taken, on a clock of the sender's own; without it the arrival
//              counts. The same time again is a duplicate, up to 0.25 s before it is late
//    hands     at most two; an empty list: no hand is seen
//    end       true: the tracker stops, so there are no hands any more
//    side      the person's own hand, "left" or "right", as far as this picture tells
//    sure      true: it is of this side for certain, as somebody has said; without it many messages
//              decide (tracks.hpp)
//    score     0 to 1, how sure the tracker is; without it 1. Below kMinScore no hand is seen
//    points    21 points of three numbers [m]: the wrist, then from thumb to little finger the
//              three joints from the palm outwards and the tip (the order of MediaPipe Hands:
//              the thumb's first is its CMC joint, a finger's first its MCP joint)
//
// Axes: right-handed, for example x to the right, y down, z away from a camera. Origin and turn do
// not matter, nor does the size: the shape of the hand counts, and two hands are told apart by
// where they were. Where z points away from a camera, what the tracker says of a palm counts more
// for the side than what it says of a back. Points of a mirrored picture are not right-handed: the
// sender mirrors them back. Members that are not named here are skipped.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "proto/frame/frame.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::landmarks {

inline constexpr std::size_t kLandmarks = 21;
inline constexpr std::size_t kMaxHands = 2;
inline constexpr std::size_t kMaxMessage = 16 * 1024;  // bytes; two hands with all digits have 3 KB
inline constexpr double kMinScore = 0.5;
// Length of a hand, from the wrist along the middle finger to its tip.
inline constexpr double kMinHand_m = 0.05;
inline constexpr double kMaxHand_m = 0.30;

using Landmarks = std::array<Vec3f, kLandmarks>;

struct TrackedHand {
  Side side = Side::kRight;
  // Set by HandTracks: the points are those of such a hand; they contradict those before.
  Side shape = Side::kRight;
  bool doubtful = false;
  bool sure = false;
  double score = 0.0;
  Outcome outcome = Outcome::kOk;  // of this hand alone
  Landmarks point_m{};

  RT_SAFE [[nodiscard]] bool seen() const noexcept { return score >= kMinScore; }
};

struct Message {
  double time_s = 0.0;  // NaN if it has none
  std::array<TrackedHand, kMaxHands> hands{};
  std::size_t count = 0;
  bool end = false;
};

// kForeign: not of this format or version; kShort: cut, no JSON, no list of hands, or a time or end
// of another kind; kOutOfRange: more than two hands, two that are surely of one side, or a time
// beyond all numbers. A single hand may be wrong by itself: kShort with another number of points,
// kOutOfRange with members that are no hand's.
RT_SAFE [[nodiscard]] Outcome read_message(std::string_view json, Message& message) noexcept;

// The message as a tracker sends it; its time is finite. Cold.
[[nodiscard]] std::string write_message(const Message& message);

}  // namespace posed::drivers::landmarks

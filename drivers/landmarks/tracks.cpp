#include "drivers/landmarks/tracks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "proto/frame/time.hpp"

namespace posed::drivers::landmarks {
namespace {

constexpr double kReach_m = 0.25;     // a hand goes no further between two messages
constexpr double kSame_m = 0.04;      // two wrists of one side that are closer are one
constexpr double kOther_m = 0.05;     // a hand of the other side counts as so much further away
constexpr double kMaxStep_s = 0.2;    // what a message counts at most
constexpr double kMaxVotes_s = 10.0;  // votes, so that a wrong beginning can be outvoted
constexpr double kFlip_s = 0.2;       // votes that it takes to change the side
constexpr std::int64_t kKnown_ns = kNanosPerSecond;  // a hand that returns later is another one
// A picture that contradicts for longer is better than none.
constexpr std::int64_t kDoubt_ns = kNanosPerSecond / 4;

RT_SAFE Eigen::Vector3d place_m(const Vec3f& point_m) noexcept {
  return Eigen::Vector3f(point_m.data()).cast<double>();
}

RT_SAFE double apart_m(const Vec3f& a, const Vec3f& b) noexcept {
  return (place_m(a) - place_m(b)).norm();
}

RT_SAFE bool recent(std::int64_t then_ns, std::int64_t now_ns,
                    std::int64_t within_ns = kKnown_ns) noexcept {
  return then_ns != kNoTime_ns && now_ns - then_ns <= within_ns;
}

RT_SAFE Eigen::Vector3d between_m(const Landmarks& point_m, std::size_t a, std::size_t b) noexcept {
  return place_m(point_m[b]) - place_m(point_m[a]);
}

// Out of the palm of a right hand, out of the back of a left one [m^2].
RT_SAFE Eigen::Vector3d palm_of(const Landmarks& point_m) noexcept {
  return between_m(point_m, 0, 5).cross(between_m(point_m, 0, 17));
}

// What the tracker's word is worth, 0 to 1. Hands show a camera their palm, so most of the backs
// that it sees are palms of the other hand, above all fists. And where it takes a little finger for
// an index finger, the palm is narrower than any hand's.
RT_SAFE double worth(const TrackedHand& hand) noexcept {
  constexpr double kBack = 0.05, kNarrow = 0.1;
  constexpr double kBreadth = 0.6;  // of a palm, knuckle to knuckle, over its length
  const double away = palm_of(hand.point_m).z() * (hand.side == Side::kRight ? 1.0 : -1.0);
  const bool narrow =
      between_m(hand.point_m, 5, 17).norm() < kBreadth * between_m(hand.point_m, 0, 9).norm();
  return hand.score * (away > 0.0 ? kBack : 1.0) * (narrow ? kNarrow : 1.0);
}

}  // namespace

RT_SAFE Side shape_of(const Landmarks& point_m, Side otherwise) noexcept {
  constexpr double kStraight = 0.1;  // of the digits' length
  const Eigen::Vector3d palm = palm_of(point_m);
  double bent_m3 = 0.0, length_m = 0.0;
  for (std::size_t first = 1; first < kLandmarks; first += 4) {
    bent_m3 += palm.dot(between_m(point_m, first, first + 3));
    for (std::size_t k = first; k < first + 3; ++k) length_m += between_m(point_m, k, k + 1).norm();
  }
  if (!(std::abs(bent_m3) > kStraight * length_m * palm.norm())) return otherwise;
  return bent_m3 > 0.0 ? Side::kRight : Side::kLeft;
}

// [m]; a track that is free costs less than one from which the hand is too far away.
RT_SAFE double HandTracks::cost(const Track& track, const TrackedHand& hand,
                                std::int64_t now_ns) noexcept {
  if (!recent(track.seen_ns, now_ns)) return kReach_m;
  const double far_m = apart_m(track.wrist_m, hand.point_m[0]);
  if (!(far_m < kReach_m)) return 2.0 * kReach_m;
  return far_m + (track.side == hand.side ? 0.0 : kOther_m);
}

RT_SAFE void HandTracks::vote(Track& track, const TrackedHand& hand, std::int64_t now_ns) noexcept {
  const bool known =
      recent(track.seen_ns, now_ns) && apart_m(track.wrist_m, hand.point_m[0]) < kReach_m;
  if (!known) track = {.side = hand.side, .seen_ns = now_ns};
  const double right = hand.side == Side::kRight ? 1.0 : -1.0;
  const double since_s = std::min(seconds(now_ns - track.seen_ns), kMaxStep_s);
  track.votes_s =
      std::clamp(track.votes_s + right * worth(hand) * since_s, -kMaxVotes_s, kMaxVotes_s);
  if (hand.sure) track.votes_s = right * kMaxVotes_s;
  if (std::abs(track.votes_s) >= kFlip_s) {
    track.side = track.votes_s > 0.0 ? Side::kRight : Side::kLeft;
  }
  track.wrist_m = hand.point_m[0];
  track.seen_ns = now_ns;
}

// Either the tracker's word or the points themselves must agree with the track.
RT_SAFE void HandTracks::judge(Track& track, TrackedHand& hand, std::int64_t now_ns) noexcept {
  const bool agrees = hand.side == track.side || shape_of(hand.point_m, hand.side) == track.side;
  hand.shape = agrees ? track.side : hand.side;
  hand.side = track.side;
  hand.doubtful = !agrees && recent(track.read_ns, now_ns, kDoubt_ns);
  if (agrees) track.read_ns = now_ns;
}

RT_SAFE void HandTracks::follow(Message& message, std::int64_t now_ns) noexcept {
  if (message.end) tracks_ = {};
  std::array<TrackedHand*, kMaxHands> hands{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < message.count; ++i) {
    TrackedHand& hand = message.hands[i];
    if (hand.outcome == Outcome::kOk && hand.seen()) hands[count++] = &hand;
  }
  if (count == kMaxHands && hands[0]->side == hands[1]->side &&
      apart_m(hands[0]->point_m[0], hands[1]->point_m[0]) < kSame_m) {
    if (hands[0]->score < hands[1]->score) std::swap(hands[0], hands[1]);
    hands[--count]->outcome = Outcome::kOutOfRange;
  }
  if (count == 0) return;
  const auto with = [&](std::size_t first) noexcept {
    return cost(tracks_[first], *hands[0], now_ns) +
           (count == 1 ? 0.0 : cost(tracks_[1 - first], *hands[1], now_ns));
  };
  const std::size_t first = with(0) <= with(1) ? 0 : 1;
  const std::array<Track*, kMaxHands> tracks{&tracks_[first], &tracks_[1 - first]};
  for (std::size_t i = 0; i < count; ++i) vote(*tracks[i], *hands[i], now_ns);
  if (count == kMaxHands && tracks[0]->side == tracks[1]->side) {  // a person has one of each
    const bool surer = std::abs(tracks[0]->votes_s) >= std::abs(tracks[1]->votes_s);
    tracks[surer ? 1 : 0]->side = tracks[0]->side == Side::kLeft ? Side::kRight : Side::kLeft;
  }
  for (std::size_t i = 0; i < count; ++i) judge(*tracks[i], *hands[i], now_ns);
}

RT_SAFE bool HandTracks::knows(Side side, std::int64_t now_ns) const noexcept {
  return std::ranges::any_of(tracks_, [&](const Track& track) noexcept {
    return track.side == side && recent(track.read_ns, now_ns);
  });
}

}  // namespace posed::drivers::landmarks

// Where a limb's two bones begin, bend and end, by the lengths along its joints. Cold.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "proto/rig/figure.hpp"

namespace posed::rig {

inline constexpr double kArmOfLeg = 0.63;  // upper and lower arm, of thigh and shin

// How far apart two lengths are, as a logarithm.
[[nodiscard]] double unlike(double one, double other);

// Numbers of joints in a limb's chain, and how long both bones are together.
struct TwoBones {
  std::size_t begin = 0, bend = 1, end = 2;
  double length = 0.0;
};

// A chain of joints of which some only twist, or help the skin.
class CutLimb {
 public:
  // Both chains of a pair, of as many joints. `palm`: the joint of the first one at which an arm
  // ends, for it spreads fingers; -1 where none does.
  CutLimb(const Figure& figure, const std::array<std::vector<int>, 2>& pair, int palm);
  // A chain of one side whose last joint, with `has_end`, is where its lower bone ends.
  CutLimb(const Figure& figure, std::vector<int> chain, bool has_end);

  // The cut that is likest a person's: two bones about as long as each other, straight, of as few
  // joints as can be, with what is left for a hand or a foot behind them. Of a chain of fewer than
  // three joints there is none.
  [[nodiscard]] std::optional<TwoBones> as_leg() const;
  // `leg`: the length of a leg's two bones; 0 when it is not known.
  [[nodiscard]] std::optional<TwoBones> as_arm(double leg) const;

 private:
  void measure(const Figure& figure, const std::vector<double>& segments);
  [[nodiscard]] double way(std::size_t from, std::size_t to) const { return at_[to] - at_[from]; }
  [[nodiscard]] double rest(const TwoBones& two) const { return at_.back() - at_[two.end]; }
  [[nodiscard]] double cost_of(const TwoBones& two) const;
  [[nodiscard]] std::optional<TwoBones> least(std::optional<std::size_t> known_end,
                                              auto cost_of_limb) const;

  std::vector<int> chain_;
  std::optional<std::size_t> leg_end_, arm_end_;  // where its bones end, if that is known
  std::optional<double> to_first_;                // from the body's middle
  std::vector<double> at_;   // [joint of the chain, then its end] along the limb
  std::vector<bool> bends_;  // [joint of the chain but the first and the last]
};

}  // namespace posed::rig

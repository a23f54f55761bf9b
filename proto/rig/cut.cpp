#include "proto/rig/cut.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace posed::rig {
namespace {

constexpr std::size_t kMaxCutJoints = 12;

// How far a length is from what is usual, beyond what people differ by.
double off(double length, double usual, double differ) {
  return std::max(0.0, unlike(length, usual) - differ);
}

// Files say little of what is behind a limb's bones: too little costs at most `unknown`.
double off_rest(double rest, double usual, double differ, double unknown) {
  const double cost = off(rest, usual, differ);
  return rest < usual ? std::min(cost, unknown) : cost;
}

}  // namespace

double unlike(double one, double other) {
  return std::abs(std::log(std::max(one, 1e-9) / std::max(other, 1e-9)));
}

CutLimb::CutLimb(const Figure& figure, const std::array<std::vector<int>, 2>& pair, int palm)
    : chain_(pair[0]),
      to_first_((figure[pair[0][0]].offset - figure[pair[1][0]].offset).norm() / 2) {
  chain_.resize(std::min(chain_.size(), kMaxCutJoints));
  std::vector<double> segments;
  for (std::size_t i = 1; i < chain_.size(); ++i) {
    segments.push_back(
        std::min(figure[pair[0][i]].offset.norm(), figure[pair[1][i]].offset.norm()));
  }
  segments.push_back(
      std::min(figure.end_length(pair[0].back()), figure.end_length(pair[1].back())));
  const auto hand = std::ranges::find(chain_, palm);
  if (hand - chain_.begin() > 1 && hand != chain_.end()) arm_end_ = hand - chain_.begin();
  measure(figure, segments);
}

CutLimb::CutLimb(const Figure& figure, std::vector<int> chain, bool has_end)
    : chain_(std::move(chain)) {
  if (has_end && chain_.size() <= kMaxCutJoints) leg_end_ = arm_end_ = chain_.size() - 1;
  chain_.resize(std::min(chain_.size(), kMaxCutJoints));
  std::vector<double> segments;
  for (std::size_t i = 1; i < chain_.size(); ++i) {
    segments.push_back(figure.between(chain_[i - 1], chain_[i]).value_or(Vec::Zero()).norm());
  }
  double behind = 0.0;
  for (const double s : figure.segments(figure.main_chain(chain_.back()))) behind += s;
  segments.push_back(behind);
  measure(figure, segments);
}

void CutLimb::measure(const Figure& figure, const std::vector<double>& segments) {
  constexpr double kBent_deg = 8.0;
  at_.push_back(0.0);
  for (const double segment : segments) at_.push_back(at_.back() + segment);
  for (std::size_t i = 1; i + 1 < chain_.size(); ++i) {
    const double bent_deg = angle_deg(figure[chain_[i]].offset, figure[chain_[i + 1]].offset);
    bends_.push_back(at_[i + 1] > at_[i] && bent_deg > kBent_deg);
  }
}

std::optional<TwoBones> CutLimb::least(std::optional<std::size_t> known_end,
                                       auto cost_of_limb) const {
  std::optional<TwoBones> found;
  double least = 1e300;
  const std::size_t count = chain_.size();
  for (std::size_t begin = 0; begin + 2 < count; ++begin) {
    for (std::size_t bend = begin + 1; bend + 1 < count; ++bend) {
      for (std::size_t end = bend + 1; end < count; ++end) {
        if (known_end && end != *known_end) continue;
        const TwoBones two{begin, bend, end, way(begin, end)};
        const double cost = cost_of(two) + cost_of_limb(two);
        if (cost >= least) continue;
        least = cost;
        found = two;
      }
    }
  }
  return found;
}

double CutLimb::cost_of(const TwoBones& two) const {
  constexpr double kInner = 0.05;  // a joint within a bone: of equal cuts the one with fewer
  constexpr double kBent = 0.5;    // one at which the zero pose bends is an elbow or a knee
  double cost = off(way(two.begin, two.bend), way(two.bend, two.end), 0.15);
  for (std::size_t i = two.begin + 1; i < two.end; ++i) {
    if (i != two.bend) cost += bends_[i - 1] ? kBent : kInner;
  }
  // A straight joint begins no limb that bends before it, or whose equal pieces do.
  if (two.begin == 0 || bends_[two.begin - 1]) return cost;
  const double before = way(two.begin - 1, two.begin);
  const bool is_piece = std::abs(before - way(two.begin, two.begin + 1)) < 0.01 * before;
  const auto bends_end = bends_.begin() + static_cast<std::ptrdiff_t>(two.begin) - 1;
  const bool bent_before = std::find(bends_.begin(), bends_end, true) != bends_end;
  return is_piece || bent_before ? cost + kBent : cost;
}

std::optional<TwoBones> CutLimb::as_leg() const {
  return least(leg_end_, [this](const TwoBones& two) {
    return 0.5 * off_rest(rest(two), 0.25 * two.length, 0.4, 1.0) +
           at_[two.begin] / std::max(two.length, 1e-9);
  });
}

std::optional<TwoBones> CutLimb::as_arm(double leg) const {
  if (!(leg > 0.0)) {
    return least(arm_end_, [](const TwoBones& two) { return -unlike(two.length, 1e-9); });
  }
  // Across the shoulders counts where the body's middle is known, else the limb begins soon.
  return least(arm_end_, [this, leg](const TwoBones& two) {
    double cost = off(two.length, kArmOfLeg * leg, 0.05);
    cost += 0.3 * off_rest(rest(two), 0.2 * leg, 0.7, 0.15);
    if (!to_first_) return cost + 0.5 * at_[two.begin] / std::max(two.length, 1e-9);
    return cost + 0.7 * off(*to_first_ + at_[two.begin], 0.3 * leg, 0.3);
  });
}

}  // namespace posed::rig

#include "models/feet/foot_hold.hpp"

#include <algorithm>
#include <cassert>

#include "models/feet/smoothing.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::feet {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kSwingTau_s = 0.08;  // how fast a swinging foot goes back to the style
constexpr double kCreep_m_s = 0.01;   // a foot that stands for long goes back by this
constexpr double kGoneTau_s = 0.3;
constexpr double kGone_m_s = 0.1;
constexpr double kGain = 2.0;  // of the weight of a contact, up to 1
constexpr double kHeld = 0.5;  // from this on the foot stands

}  // namespace

// Moves and turns the foot as the performer's.
RT_SAFE void FootHold::stand(const FootPair& pair, const std::array<PointContact, kPoints>& contact,
                             double hold) noexcept {
  const FootPair::Foot& performer = pair.performer;
  const FootPair::Foot& avatar = pair.avatar;
  const Quaterniond old_turn(rotation_exp(change_.turn_rad));
  const Quaterniond wanted = performer.rotation * before_.performer.rotation.conjugate() *
                             old_turn * before_.avatar.rotation * avatar.rotation.conjugate();
  const Vector3d turn_rad = rotation_log(wanted);
  change_.turn_rad += hold * (turn_rad - change_.turn_rad);
  const Quaterniond turn(rotation_exp(change_.turn_rad));
  Vector3d wanted_m = Vector3d::Zero();
  double weight = 0.0;
  for (const std::size_t p : {kAnkle, kToe}) {
    const double w = contact[p].weight;
    if (w <= 0.0) continue;
    const Vector3d& ankle_m = avatar.point_m[kAnkle];
    const Vector3d& old_ankle_m = before_.avatar.point_m[kAnkle];
    const Vector3d now_m = ankle_m + turn * (avatar.point_m[p] - ankle_m);
    const Vector3d old_m = old_ankle_m + old_turn * (before_.avatar.point_m[p] - old_ankle_m);
    const Vector3d performed_m = performer.point_m[p] - before_.performer.point_m[p];
    wanted_m += w * (performed_m - (now_m - old_m));
    weight += w;
  }
  if (weight > 0.0) change_.ankle_m += hold * wanted_m / weight;
}

RT_SAFE const FootHold::Change& FootHold::update(const FootPair& pair,
                                                 const std::array<PointContact, kPoints>& contact,
                                                 const HoldOptions& options, double gone,
                                                 double dt_s) noexcept {
  assert(dt_s > 0.0);
  const double most = std::max(contact[kAnkle].weight, contact[kToe].weight);
  const double hold = options.share * std::min(1.0, kGain * most) * (1.0 - gone);
  const bool held = hold >= kHeld * options.share;
  if (held && !held_) begun_ = change_;
  if (started_ && hold > 0.0) stand(pair, contact, hold);
  if (held_ && !held) {
    const double half = options.ahead ? 0.5 : 0.0;
    home_.ankle_m = half * (begun_.ankle_m - change_.ankle_m);
    home_.turn_rad = half * (begun_.turn_rad - change_.turn_rad);
  }
  const double swing = smoothing((1.0 - hold) * dt_s, kSwingTau_s) * (1.0 - gone);
  change_.ankle_m += swing * (home_.ankle_m - change_.ankle_m);
  change_.turn_rad += swing * (home_.turn_rad - change_.turn_rad);
  const double creep_m = (hold * kCreep_m_s + gone * kGone_m_s) * dt_s;
  change_.ankle_m = approached(change_.ankle_m, gone * dt_s / kGoneTau_s, creep_m);
  change_.turn_rad = approached(change_.turn_rad, gone * dt_s / kGoneTau_s, creep_m);
  before_ = pair;
  started_ = true;
  held_ = held;
  return change_;
}

}  // namespace posed::feet

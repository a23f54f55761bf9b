#include "models/feet/root_motion.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "models/feet/smoothing.hpp"
#include "proto/frame/smooth_step.hpp"

namespace posed::feet {
namespace {

constexpr double kFlight = 1e-3;           // weight of going on as before where no foot stands
constexpr double kStands = 4.0;            // times the weight of the points is all of standing
constexpr double kDriftTau_s = 0.3;        // over which the offset's own speed is averaged
constexpr double kForgetTau_s = 1.0;       // over which it ends where no foot stands
constexpr double kMaxDrift_m_s = 3.0;      // no style changes the speed of a walk by more
constexpr double kGoesTau_s = 0.5;         // for how the root goes beside the feet
constexpr double kStandingFeet_m_s = 0.2;  // slower feet tell nothing
constexpr double kGoes = 0.5;              // speed of the root over that of the feet beside it
constexpr double kInPlace = 0.2;           // the same for who walks in place
constexpr double kReturnTau_s = 1.0;       // the offset returns by this share of itself ...
constexpr double kReturn_m_s = 0.1;        // ... and by this
constexpr double kStepTau_s = 0.02;        // smooths the change from foot to foot
constexpr double kSoft_m = 0.02;           // the lowest point counts gradually within so much
constexpr double kLiftTau_s = 0.03;        // and the height follows it within so long
constexpr double kSettled_m = 1e-4;        // a height without a style below this is none
constexpr double kActorTau_s = 0.2;        // the same for a root that stays on the performer

Eigen::Vector3d shortened(const Eigen::Vector3d& v, double length) {
  const double norm = v.norm();
  return norm > length ? Eigen::Vector3d(v * (length / norm)) : v;
}

}  // namespace

RootMotion::RootMotion(const Legs& legs) noexcept : legs_(&legs), scale_(legs.scale()) {}

RT_SAFE void RootMotion::forget() noexcept {
  restart();
  offset_m_.setZero();
  drift_m_s_.setZero();
  root_m_s_.setZero();
  feet_m_s_ = 0.0;
  goes_ = 1.0;
  pending_m_.setZero();
  rest_m_.setZero();
  emitted_m_.setZero();
  fresh_ = true;
}

// Sets goes_.
RT_SAFE void RootMotion::look_where_it_goes(const OfPoints<Placed>& now,
                                            const Eigen::Vector3d& root_m, double dt_s) noexcept {
  Eigen::Vector3d step_m = root_m - std::exchange(last_root_m_, root_m);
  if (!started_) return;
  double feet_m = 0.0;
  int feet = 0;
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    if (!now[leg][kAnkle].known || !before_[leg][kAnkle].known) continue;
    const Eigen::Vector3d foot_m =
        now[leg][kAnkle].performer_m - before_[leg][kAnkle].performer_m - step_m;
    feet_m += std::hypot(foot_m.x(), foot_m.z());
    ++feet;
  }
  if (feet == 0) return;
  step_m.y() = 0.0;
  const double share = smoothing(dt_s, kGoesTau_s);
  root_m_s_ += share * (step_m / dt_s - root_m_s_);
  feet_m_s_ += share * (feet_m / feet / dt_s - feet_m_s_);
  if (feet_m_s_ < kStandingFeet_m_s * scale_) return;
  goes_ = smooth_step((root_m_s_.norm() / feet_m_s_ - kInPlace) / (kGoes - kInPlace));
}

// The offset moves so that standing points move over the ground as the performer's do: the weighted
// mean of what each of them asks for.
RT_SAFE void RootMotion::walk(const OfPoints<Placed>& now, const Contacts& contacts, double dt_s,
                              const RootChange* learnt) noexcept {
  double weight = 0.0;
  Eigen::Vector3d wanted_m = Eigen::Vector3d::Zero();
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    for (const std::size_t p : {kAnkle, kToe}) {
      const Placed& at = now[leg][p];
      const Placed& before = before_[leg][p];
      if (!at.known || !before.known) continue;
      const double w = contacts.point(leg, p).weight;
      weight += w;
      wanted_m += w * ((at.performer_m - before.performer_m) - (at.avatar_m - before.avatar_m));
    }
  }
  Eigen::Vector3d step_m = (wanted_m + kFlight * dt_s * drift_m_s_) / (weight + kFlight);
  if (learnt != nullptr) {
    // In flight the style's own speed.
    const double stands = std::min(1.0, kStands * weight);
    const Eigen::Vector3f flight_m_s(learnt->velocity_m_s.data());
    step_m = stands * wanted_m / std::max(weight, kFlight) +
             (1.0 - stands) * goes_ * dt_s * flight_m_s.cast<double>();
  }
  step_m.y() = 0.0;
  step_m = shortened(step_m, kMaxDrift_m_s * scale_ * dt_s);
  const double trust = weight / (weight + kFlight);
  drift_m_s_ += smoothing(dt_s * trust, kDriftTau_s) * (step_m / dt_s - drift_m_s_);
  drift_m_s_ *= std::exp(-dt_s * (1.0 - trust) / kForgetTau_s);
  // A share of what is pending, so that frames at uneven times still add up to every step.
  pending_m_ += step_m;
  const Eigen::Vector3d smooth_m = smoothing(dt_s, kStepTau_s) * pending_m_;
  offset_m_ += smooth_m;
  pending_m_ -= smooth_m;
}

// The way back to the performer, over the ground.
RT_SAFE void RootMotion::come_back(double gone, double dt_s, RootMode mode) noexcept {
  const double share = mode == RootMode::kActor ? kReturnTau_s / kActorTau_s : gone;
  const Eigen::Vector3d back =
      approached(Eigen::Vector3d(offset_m_.x(), 0.0, offset_m_.z()), share * dt_s / kReturnTau_s,
                 gone * kReturn_m_s * scale_ * dt_s);
  offset_m_.x() = back.x();
  offset_m_.z() = back.z();
}

// How high the lowest points of a body are above where such points stand; those within a few
// centimetres of the lowest count gradually, so that another lowest point is no step.
RT_SAFE double RootMotion::lowest_m(const OfPoints<Placed>& now, const Contacts& contacts,
                                    Eigen::Vector3d Placed::* body) const noexcept {
  double lowest_m = std::numeric_limits<double>::infinity();
  for (const auto& leg : now) {
    for (std::size_t p = 0; p < kPoints; ++p) {
      if (leg[p].known) lowest_m = std::min(lowest_m, (leg[p].*body).y() - contacts.ground_m(p));
    }
  }
  const double soft_m = kSoft_m * scale_;
  double sum = 0.0;
  for (const auto& leg : now) {
    for (std::size_t p = 0; p < kPoints; ++p) {
      if (!leg[p].known) continue;
      sum += std::exp((lowest_m - ((leg[p].*body).y() - contacts.ground_m(p))) / soft_m);
    }
  }
  return lowest_m - soft_m * std::log(sum);
}

// The height that brings the avatar's feet as near to the ground as the performer's.
RT_SAFE void RootMotion::lift(const OfPoints<Placed>& now, const Contacts& contacts, double gone,
                              double dt_s) noexcept {
  const double wanted_m =
      lowest_m(now, contacts, &Placed::performer_m) - lowest_m(now, contacts, &Placed::avatar_m);
  if (!std::isfinite(wanted_m)) return;  // no foot is known
  const double share = fresh_ ? 1.0 : smoothing(dt_s, kLiftTau_s);
  offset_m_.y() += share * (wanted_m - offset_m_.y());
  if (gone >= 1.0 && std::abs(offset_m_.y()) < kSettled_m) offset_m_.y() = 0.0;
}

RT_SAFE OfPoints<RootMotion::Placed> RootMotion::placed(const PosePair& pair) const noexcept {
  OfPoints<Placed> now{};
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    if (!pair.performer.measured[leg] || !pair.avatar.measured[leg]) continue;
    for (std::size_t p = 0; p < kPoints; ++p) {
      if (!legs_->leg(leg).has(p)) continue;
      now[leg][p] = {.performer_m = pair.root_m + pair.performer.point_from_root_m[leg][p],
                     .avatar_m = pair.root_m + pair.avatar.point_from_root_m[leg][p],
                     .known = true};
    }
  }
  return now;
}

// Whether the same points are known as in the frame before.
RT_SAFE bool RootMotion::same_points(const OfPoints<Placed>& now) const noexcept {
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    if (now[leg][kAnkle].known != before_[leg][kAnkle].known) return false;
  }
  return true;
}

RT_SAFE Eigen::Vector3d RootMotion::update(const PosePair& pair, const Contacts& contacts,
                                           double gone, double dt_s,
                                           const RootOptions& options) noexcept {
  assert(dt_s > 0.0);
  const OfPoints<Placed> now = placed(pair);
  const bool off = options.mode == RootMode::kOff;
  look_where_it_goes(now, pair.root_m, dt_s);
  if (off) {
    offset_m_.setZero();
    drift_m_s_.setZero();
    pending_m_.setZero();
  } else {
    if (started_) walk(now, contacts, dt_s, pair.learnt);
    come_back(gone, dt_s, options.mode);
    if (pair.learnt != nullptr) {
      offset_m_.y() = static_cast<double>(pair.learnt->height_m);
    } else {
      lift(now, contacts, gone, dt_s);
    }
    if (options.mode == RootMode::kActor) offset_m_ = shortened(offset_m_, options.limit_m);
  }
  const bool limited = options.mode == RootMode::kActor && options.limit_m != last_.limit_m;
  const bool learnt = pair.learnt != nullptr;
  const bool jumps = options.mode != last_.mode || limited || learnt != learnt_ ||
                     (started_ && !off && !same_points(now));
  if (jumps && !fresh_) rest_m_ = emitted_m_ - offset_m_;
  rest_m_ = approached(rest_m_, dt_s / kReturnTau_s, kReturn_m_s * scale_ * dt_s);
  emitted_m_ = offset_m_ + rest_m_;
  last_ = options;
  learnt_ = learnt;
  before_ = now;
  started_ = true;
  fresh_ = false;
  return emitted_m_;
}

}  // namespace posed::feet

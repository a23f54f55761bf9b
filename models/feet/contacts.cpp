#include "models/feet/contacts.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "models/feet/smoothing.hpp"

namespace posed::feet {
namespace {

// For a leg of kReferenceLeg_m; other legs scale them.
constexpr double kStand_m_s = 0.25;   // a slower point begins to stand
constexpr double kLeave_m_s = 0.5;    // a faster one no longer stands
constexpr double kWeight_m_s = 0.2;   // at this speed the weight has fallen to 1 / e
constexpr double kLow_m = 0.06;       // so far above the ground a point stands at once
constexpr double kPatience_s = 0.15;  // above that only after it has been slow for so long: a stair
constexpr double kSpeedTau_s = 0.012;  // smooths the speed at high rates
constexpr double kGroundTau_s = 0.2;   // how fast the ground becomes the height where one stands

double bell(double x) { return std::exp(-x * x); }

}  // namespace

Contacts::Contacts(const Legs& legs) noexcept : legs_(&legs), scale_(legs.scale()) {}

RT_SAFE void Contacts::forget() noexcept {
  restart();
  grounded_.fill(false);
}

RT_SAFE void Contacts::follow(Track& track, const Eigen::Vector3d& at_m, double dt_s) noexcept {
  if (track.seen) {
    const Eigen::Vector3d velocity_m_s = (at_m - track.at_m) / dt_s;
    track.velocity_m_s += smoothing(dt_s, kSpeedTau_s) * (velocity_m_s - track.velocity_m_s);
  } else {
    track.velocity_m_s.setZero();
    track.slow_s = 0.0;
  }
  track.at_m = at_m;
}

RT_SAFE void Contacts::judge(const Track& track, std::size_t point,
                             PointContact& contact) const noexcept {
  const double height_m = std::max(0.0, track.at_m.y() - ground_m_[point]);
  contact.speed_m_s = track.velocity_m_s.norm();
  const bool lasts = height_m < kLow_m * scale_ || track.slow_s >= kPatience_s;
  const double limit_m_s = (contact.standing ? kLeave_m_s : kStand_m_s) * scale_;
  contact.standing = contact.speed_m_s < limit_m_s && (contact.standing || lasts);
  const double near = contact.standing ? 1.0 : bell(height_m / (kLow_m * scale_));
  contact.weight = near * bell(contact.speed_m_s / (kWeight_m_s * scale_));
}

RT_SAFE double Contacts::both_stand() const noexcept {
  double least = 1.0;
  for (const auto& leg : contact_) {
    double most = 0.0;
    for (const PointContact& point : leg) most = std::max(most, point.weight);
    least = std::min(least, most);
  }
  return least;
}

RT_SAFE void Contacts::update(const LegPose& pose, const Eigen::Vector3d& root_m,
                              double dt_s) noexcept {
  assert(dt_s > 0.0);
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    for (std::size_t p = 0; p < kPoints; ++p) {
      Track& track = track_[leg][p];
      PointContact& contact = contact_[leg][p];
      if (!pose.measured[leg] || !legs_->leg(leg).has(p)) {
        track.seen = false;
        contact = {};
        continue;
      }
      const Eigen::Vector3d at_m = root_m + pose.point_from_root_m[leg][p];
      track.seen = track.seen && started_;
      follow(track, at_m, dt_s);
      if (!grounded_[p] || at_m.y() < ground_m_[p]) ground_m_[p] = at_m.y();
      grounded_[p] = true;
      judge(track, p, contact);
      // The first frame shows no speed.
      if (!track.seen) contact = {};
      const bool slow = track.seen && contact.speed_m_s < kStand_m_s * scale_;
      track.slow_s = slow ? track.slow_s + dt_s : 0.0;
      if (contact.standing) {
        ground_m_[p] += smoothing(dt_s, kGroundTau_s) * (at_m.y() - ground_m_[p]);
      }
      track.seen = true;
    }
  }
  started_ = true;
}

}  // namespace posed::feet

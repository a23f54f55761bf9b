#include "drivers/p5/camera_rig.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"

namespace posed::drivers::p5 {
namespace {

constexpr double kInch_m = 0.0254;
constexpr double kFocal = 512.0;         // counts at a tangent of 1
constexpr double kMaxDistance_m = 10.0;  // longer than any cable
// Tilt of the heads of glove type 0; for other types it is not known.
constexpr double kLean1_deg = 17.0;
constexpr double kLean2_deg = -10.0;

double correction_rad(std::byte byte) {
  return static_cast<double>(static_cast<std::int8_t>(byte)) / 32.0 * kDegree;
}

double hundredths_m(std::span<const std::byte> bytes) {
  const auto value = static_cast<std::int16_t>(std::to_integer<unsigned>(bytes[0]) << 8 |
                                               std::to_integer<unsigned>(bytes[1]));
  return value / 100.0 * kInch_m;
}

std::int16_t counts(double tangent) {
  return static_cast<std::int16_t>(std::lround(std::clamp(kFocal * tangent, -615.0, 615.0)));
}

// Returns the LEDs whose distances to at least two others are correct.
RT_SAFE std::bitset<kLeds> agreeing(const CameraRig& rig,
                                    const std::array<Eigen::Vector3d, kLeds>& position_m,
                                    const std::bitset<kLeds>& seen) noexcept {
  constexpr double kTolerance = 0.2;
  std::bitset<kLeds> good;
  for (std::size_t i = 0; i < kLeds; ++i) {
    int right = 0;
    for (std::size_t k = 0; k < kLeds; ++k) {
      if (i == k || !seen[i] || !seen[k]) continue;
      const double known_m = (rig.led_m[i] - rig.led_m[k]).norm();
      const double found_m = (position_m[i] - position_m[k]).norm();
      if (known_m > 0.0 && std::abs(found_m - known_m) <= kTolerance * known_m) ++right;
    }
    good[i] = right >= 2;
  }
  return good;
}

}  // namespace

CameraRig CameraRig::of(std::span<const std::byte, kHeadsBytes> heads,
                        std::span<const std::byte, kLedsBytes> leds) {
  CameraRig rig;
  const bool leans = leds[1] == std::byte{0};
  rig.tilt1_rad = correction_rad(heads[1]) + (leans ? kLean1_deg * kDegree : 0.0);
  rig.tilt2_rad = correction_rad(heads[3]) + (leans ? kLean2_deg * kDegree : 0.0);
  rig.distance_m = std::to_integer<int>(heads[5]) / 10.0 * kInch_m;
  for (std::size_t i = 0; i < kLeds; ++i) {
    const auto at = leds.subspan(2 + 6 * i, 6);
    rig.led_m[i] = {-hundredths_m(at), hundredths_m(at.subspan(2)), hundredths_m(at.subspan(4))};
  }
  return rig;
}

RT_SAFE bool CameraRig::locate(const LedObservation& spot,
                               Eigen::Vector3d& position_m) const noexcept {
  const double tan1 = std::tan(std::atan(spot.v1 / kFocal) + tilt1_rad);
  const double tan2 = std::tan(std::atan(spot.v2 / kFocal) + tilt2_rad);
  const double beta_rad = std::atan(spot.h / kFocal);
  const double range_m = distance_m / (tan1 - tan2);
  if (!(range_m > 0.0 && range_m <= kMaxDistance_m)) return false;
  position_m = {-std::sin(beta_rad) * range_m, tan1 * range_m - distance_m / 2.0,
                std::cos(beta_rad) * range_m - 2.0 * distance_m};
  return true;
}

LedObservation CameraRig::project(std::size_t led, const Eigen::Vector3d& position_m) const {
  const double ahead_m = position_m.z() + 2.0 * distance_m;
  const double range_m = std::hypot(position_m.x(), ahead_m);
  const double tan1 = (position_m.y() + distance_m / 2.0) / range_m;
  const double tan2 = tan1 - distance_m / range_m;
  return {.led = static_cast<std::uint8_t>(led),
          .v2 = counts(std::tan(std::atan(tan2) - tilt2_rad)),
          .v1 = counts(std::tan(std::atan(tan1) - tilt1_rad)),
          .h = counts(-position_m.x() / ahead_m)};
}

RT_SAFE bool fit_hand(const CameraRig& rig, const std::array<Eigen::Vector3d, kLeds>& position_m,
                      std::bitset<kLeds> seen, RigidPose& place) noexcept {
  const std::bitset<kLeds> good = agreeing(rig, position_m, seen);
  if (good.count() < 3) return false;
  const double share = 1.0 / static_cast<double>(good.count());
  Eigen::Vector3d found_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d known_m = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < kLeds; ++i) {
    if (!good[i]) continue;
    found_m += share * position_m[i];
    known_m += share * rig.led_m[i];
  }
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < kLeds; ++i) {
    if (good[i]) spread += (position_m[i] - found_m) * (rig.led_m[i] - known_m).transpose();
  }
  // The rotation that maps the known LEDs best onto the measured ones (Kabsch algorithm).
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(spread, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // With LEDs on one line, the rotation about that line is undetermined.
  if (!(svd.singularValues()[1] > 1e-3 * svd.singularValues()[0])) return false;
  Eigen::Matrix3d keep = Eigen::Matrix3d::Identity();
  keep(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d rotation = svd.matrixU() * keep * svd.matrixV().transpose();
  place.rotation = Eigen::Quaterniond(rotation).normalized();
  if (place.rotation.w() < 0.0) place.rotation.coeffs() *= -1.0;
  place.position_m = found_m - rotation * known_m;
  return true;
}

}  // namespace posed::drivers::p5

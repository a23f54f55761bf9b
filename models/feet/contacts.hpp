// Contacts: which points of the performer's feet stand, found in the unstyled input by speed and
// height with hysteresis (models/feet/README.md, "Contacts"). Causal; each frame is judged as it
// comes. One thread.
#pragma once

#include <array>

#include <Eigen/Core>

#include "models/feet/legs.hpp"

namespace posed::feet {

struct PointContact {
  bool standing = false;
  double speed_m_s = 0.0;
  double weight = 0.0;  // 0 moves .. 1 stands still, without a step between them
};

class Contacts {
 public:
  // All lengths and speeds scale with `legs`, which must outlive this object.
  explicit Contacts(const Legs& legs) noexcept;

  // Judges the performer's next pose, `dt_s` > 0 after the last one.
  RT_SAFE void update(const LegPose& pose, const Eigen::Vector3d& root_m, double dt_s) noexcept;
  // The next pose does not continue the last one; the ground stays.
  RT_SAFE void restart() noexcept { started_ = false; }
  // As restart(), and the height of the ground is forgotten, too.
  RT_SAFE void forget() noexcept;

  [[nodiscard]] const PointContact& point(std::size_t leg, std::size_t point) const noexcept {
    return contact_[leg][point];
  }
  // 1 while both legs stand, 0 while one moves or is not measured.
  RT_SAFE [[nodiscard]] double both_stand() const noexcept;
  // Height [m] at which `point` (ankle, toe, tip) of either foot stands.
  RT_SAFE [[nodiscard]] double ground_m(std::size_t point) const noexcept {
    return ground_m_[point];
  }

 private:
  struct Track {
    Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
    double slow_s = 0.0;  // how long the point has been slow
    bool seen = false;    // the frame before measured it
  };

  void follow(Track& track, const Eigen::Vector3d& at_m, double dt_s) noexcept;
  void judge(const Track& track, std::size_t point, PointContact& contact) const noexcept;

  const Legs* legs_;
  double scale_;
  OfPoints<Track> track_{};
  OfPoints<PointContact> contact_{};
  std::array<double, kPoints> ground_m_{};
  std::array<bool, kPoints> grounded_{};  // ground_m_ is known
  bool started_ = false;
};

}  // namespace posed::feet

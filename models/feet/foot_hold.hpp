// FootHold: how far a foot of the avatar must be from where the style put it so that it stands: it
// moves and turns as the performer's does while that stands, and goes back to the style while it
// swings (README.md, "Hold"). Causal. One thread.
#pragma once

#include <array>

#include <Eigen/Geometry>

#include "models/feet/contacts.hpp"
#include "models/feet/legs.hpp"

namespace posed::feet {

// A foot of the performer and of the avatar at one instant, in the world.
struct FootPair {
  struct Foot {
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    std::array<Eigen::Vector3d, kPoints> point_m{};
  };
  Foot performer, avatar;
};

// How strongly a foot is held.
struct HoldOptions {
  double share = 1.0;  // of the way that a standing foot would slide, 0 to 1
  // Whether a swinging foot goes ahead by half of what it was held back in the last stance, so that
  // a stance begins as far from the style as it ends.
  bool ahead = false;
};

class FootHold {
 public:
  struct Change {
    Eigen::Vector3d ankle_m = Eigen::Vector3d::Zero();   // the ankle is moved by
    Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  // rotation vector, world axes

    [[nodiscard]] bool none() const noexcept {
      return ankle_m.isZero(kNone) && turn_rad.isZero(kNone);
    }
    static constexpr double kNone = 1e-6;
  };

  // Advances by a frame, `dt_s` > 0 after the last one. `gone`: 1 where the style moves no foot.
  RT_SAFE const Change& update(const FootPair& pair,
                               const std::array<PointContact, kPoints>& contact,
                               const HoldOptions& options, double gone, double dt_s) noexcept;
  // Call where the leg could not reach so far: the ankle was moved by this only.
  RT_SAFE void reached(const Eigen::Vector3d& ankle_m) noexcept { change_.ankle_m = ankle_m; }
  // The next frame does not continue the last one. The change stays.
  RT_SAFE void restart() noexcept { started_ = false; }

 private:
  void stand(const FootPair& pair, const std::array<PointContact, kPoints>& contact,
             double hold) noexcept;

  FootPair before_{};
  bool started_ = false;
  bool held_ = false;  // the foot stood in the frame before
  Change change_{};
  Change home_{};   // where the change goes while the foot swings: half of a stance's way, ahead
  Change begun_{};  // the change when the stance began
};

}  // namespace posed::feet

// RootMotion: where the avatar's root is beside the performer's, so that its standing feet move as
// the performer's do and none sinks into the ground (models/feet/README.md, "Root"). Causal. One
// thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include <Eigen/Core>

#include "models/feet/contacts.hpp"
#include "models/feet/legs.hpp"
#include "models/stage.hpp"

namespace posed::feet {

// What the root does.
enum class RootMode : std::uint8_t {
  kOff,     // it is the performer's
  kStride,  // it goes as far as the styled legs walk
  kActor,   // it stays near the performer's
};

// Their names, in that order.
inline constexpr std::array<std::string_view, 3> kRootModes{"off", "stride", "actor"};

[[nodiscard]] constexpr std::string_view root_name(RootMode mode) noexcept {
  return kRootModes[static_cast<std::size_t>(mode)];
}
// The mode of this name; empty for another word.
[[nodiscard]] constexpr std::optional<RootMode> root_mode(std::string_view name) noexcept {
  for (std::size_t i = 0; i < kRootModes.size(); ++i) {
    if (kRootModes[i] == name) return static_cast<RootMode>(i);
  }
  return std::nullopt;
}

struct RootOptions {
  RootMode mode = RootMode::kStride;
  double limit_m = 0.08;  // kActor only: how far the root may be from the performer's
};

// One frame of the performer and of the avatar: the same instant before and after the style.
struct PosePair {
  const LegPose& performer;
  const LegPose& avatar;
  Eigen::Vector3d root_m;              // of both, as the source has it
  const RootChange* learnt = nullptr;  // what the style asks of the root; null: nobody knows
};

class RootMotion {
 public:
  explicit RootMotion(const Legs& legs) noexcept;

  // The offset of the avatar's root [m] for a frame, `dt_s` > 0 after the last one. `gone` is 0
  // while the poses differ and 1 where they do not: then the offset returns to 0.
  RT_SAFE Eigen::Vector3d update(const PosePair& pair, const Contacts& contacts, double gone,
                                 double dt_s, const RootOptions& options) noexcept;
  // The offset of the last frame [m].
  RT_SAFE [[nodiscard]] const Eigen::Vector3d& offset_m() const noexcept { return emitted_m_; }
  // The next frame does not continue the last one. The offset stays.
  RT_SAFE void restart() noexcept { started_ = false; }
  // Restarts with the avatar where the performer is.
  RT_SAFE void forget() noexcept;

 private:
  struct Placed {
    Eigen::Vector3d performer_m;  // in the world
    Eigen::Vector3d avatar_m;     // in the world, if its root were the performer's
    bool known = false;
  };

  [[nodiscard]] OfPoints<Placed> placed(const PosePair& pair) const noexcept;
  void walk(const OfPoints<Placed>& now, const Contacts& contacts, double dt_s,
            const RootChange* learnt) noexcept;
  void look_where_it_goes(const OfPoints<Placed>& now, const Eigen::Vector3d& root_m,
                          double dt_s) noexcept;
  void come_back(double gone, double dt_s, RootMode mode) noexcept;
  [[nodiscard]] double lowest_m(const OfPoints<Placed>& now, const Contacts& contacts,
                                Eigen::Vector3d Placed::* body) const noexcept;
  void lift(const OfPoints<Placed>& now, const Contacts& contacts, double gone,
            double dt_s) noexcept;
  [[nodiscard]] bool same_points(const OfPoints<Placed>& now) const noexcept;

  const Legs* legs_;
  double scale_;
  OfPoints<Placed> before_{};
  RootOptions last_{.mode = RootMode::kOff};            // of the frame before
  bool started_ = false;                                // before_ is of the frame before
  bool learnt_ = false;                                 // the frame before had a learnt root
  bool fresh_ = true;                                   // there was no frame
  Eigen::Vector3d offset_m_ = Eigen::Vector3d::Zero();  // the offset that the mode asks for
  Eigen::Vector3d pending_m_ =
      Eigen::Vector3d::Zero();  // the part of offset_m_'s steps still to be made
  // The performer's root, and its feet beside it, averaged over half a second.
  Eigen::Vector3d last_root_m_ = Eigen::Vector3d::Zero(), root_m_s_ = Eigen::Vector3d::Zero();
  double feet_m_s_ = 0.0;
  // 1 where the root goes as the legs walk, 0 where it stays: on a treadmill, or in a stream that
  // does not know where the performer is.
  double goes_ = 1.0;
  Eigen::Vector3d drift_m_s_ = Eigen::Vector3d::Zero();  // speed of the offset while feet stood
  // What is left of a jump of offset_m_, by another mode or limit or other joints: it is added,
  // and returns to 0 like the offset.
  Eigen::Vector3d rest_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d emitted_m_ = Eigen::Vector3d::Zero();
};

}  // namespace posed::feet

// Finds T frames: the world rotation of each bone's joint in the canonical T-pose (+Y up, +X left,
// +Z forward). The zero pose decides wherever it shows a person. Where limbs are folded in it, the
// clip's motion answers one question at a time (which local axis is the hinge?), and only by a wide
// margin; so T is the same for every clip of one figure. Cold; one thread.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/rig/bones.hpp"
#include "proto/rig/motion.hpp"
#include "proto/rig/up.hpp"

namespace posed::rig {

// How sure a T frame is, and what it was derived from.
struct Evidence {
  // 1 zero pose, .9 one question answered clearly, .8 the clip decided, .5 the zero pose of an
  // incomplete person, at most .4 a guess.
  double sure = 0.0;
  std::string why;
};

// How a limb bends in the clip: the mean axis in the upper joint's frame, the 90th percentile of
// the angle [deg], and how far all bends agree (1: one axis, one way).
struct Bend {
  Vec axis;
  double flex_deg = 0.0;
  double agree = 0.0;
};

class Frames {
 public:
  // The arguments outlive the object. `notes` gets sentences for users.
  Frames(const Figure& figure, const std::vector<JointName>& names, const BoneJoints& joint,
         const Motion& motion, std::vector<std::string>& notes);

  // States the T of a bone; the bones that go with it follow. Call before the functions below.
  void know(Bone bone, const Mat& T) { known_[index(bone)] = T; }
  void find_person();  // only if can_find_person()
  void find_hand(Side side);
  void lay_parts();  // for an incomplete figure: from a zero pose near the T-pose
  [[nodiscard]] bool can_find_person() const;

  // After find_person: +1 where knees and elbows clearly bend as a person's do, -1 where they all
  // do as of one who faces the other way, 0 else and where the zero pose is folded.
  [[nodiscard]] int bends_ahead() const;

  [[nodiscard]] const std::optional<Mat>& t_frame(Bone bone) const { return T_[index(bone)]; }
  [[nodiscard]] const Evidence& evidence(Bone bone) const { return evidence_[index(bone)]; }
  [[nodiscard]] UpAxis up() const { return up_; }
  [[nodiscard]] const std::string& why_up() const { return why_up_; }
  [[nodiscard]] const std::string& up_doubt() const { return up_doubt_; }  // empty: none
  [[nodiscard]] bool up_by_zero_pose() const { return up_by_zero_pose_; }
  // In the file's unit of length.
  [[nodiscard]] double leg_length() const;
  [[nodiscard]] double hand_length(Side side) const;

 private:
  struct Lateral {  // a local axis, and how well it serves as the left of a leg
    Vec axis;
    double score = 0.0;
  };
  using Both = std::array<Vec, 2>;  // [side]

  static std::size_t index(Bone bone) { return static_cast<std::size_t>(bone); }
  void set(Bone bone, const Mat& T, double sure, std::string why);
  [[nodiscard]] double sure(Bone bone) const { return evidence_[index(bone)].sure; }

  // The way from one bone to another below it, in the zero pose.
  [[nodiscard]] std::optional<Vec> off(Bone from, Bone to) const;
  // The same to the first of the bones `after` that is not at the same place.
  [[nodiscard]] std::optional<Vec> rest(Bone bone, std::initializer_list<Bone> after) const;
  [[nodiscard]] std::optional<Vec> leaf(Bone bone) const;  // the same to the farthest child or tip
  [[nodiscard]] Bend bend(Bone upper, Bone lower, Bone end) const;
  // Mean angle over the clip of the bone's canonical rotation, if its T were this [deg].
  [[nodiscard]] double bent_deg(Bone before, Bone bone, const Mat& T) const;

  void pelvis();
  [[nodiscard]] Vec pelvis_up(const Vec& line, const std::vector<Vec>& hints) const;
  void trunk();
  void find_chest();
  void trunk_bone(Bone before, Bone bone, const std::optional<Vec>& rest_way);
  void head(Bone before, const Mat& T, double sure_now, const std::string& why);
  [[nodiscard]] int foot(Side side) const;
  [[nodiscard]] bool walks(const Vec& up) const;
  [[nodiscard]] bool is_above_floor(const Vec& place, const Vec& up) const;
  [[nodiscard]] std::optional<UpAxis> up_by_root() const;
  void find_up();
  void legs();
  [[nodiscard]] bool legs_by_feet(const Both& thigh);
  void folded_legs(const Both& thigh);
  [[nodiscard]] std::vector<Lateral> laterals(Side side, const Vec& thigh) const;
  void leg(Side side, const Mat& T, double sure, const std::string& why);
  void real_foot(Side side, double sure, bool by_feet);
  void folded_foot(Side side, double sure);
  enum class Sole : std::uint8_t { kFlat, kAlongShin, kUnclear };
  [[nodiscard]] Sole sole_of(Side side, const Mat& T_flat, const Mat& T_shin) const;
  [[nodiscard]] std::optional<Vec> foot_way(Side side) const;
  [[nodiscard]] Lateral foot_lateral(Side side, const Vec& way) const;
  [[nodiscard]] std::optional<Vec> folded_way(Side side) const;
  [[nodiscard]] std::optional<Vec> toe_way(Side side) const;
  [[nodiscard]] double foot_length(Side side) const;
  void find_sole();
  void add_slopes(Side side, std::vector<double>& slopes) const;
  void arms();
  [[nodiscard]] bool arms_slant(const Both& way, const Vec& left, const Vec& right) const;
  [[nodiscard]] bool arms_are_real(const Both& arm,
                                   const std::array<std::optional<Vec>, 2>& palm) const;
  void arms_by_elbows(const Both& arm);
  [[nodiscard]] bool elbows_tell(const Both& arm) const;
  [[nodiscard]] bool palms_are_thumbs() const;
  [[nodiscard]] std::optional<Vec> hinge(Side side, const Vec& arm,
                                         const std::optional<Vec>& like) const;
  [[nodiscard]] std::optional<Vec> palm(Side side) const;
  void arm(Side side, const Mat& T, double sure, const std::string& why, bool folded);
  void fingers(Side side);
  [[nodiscard]] std::optional<double> bends_off_deg(Bone upper, Side side) const;
  void check_hinges();
  void lay(Bone bone, const Mat& T_parent);

  const Figure& figure_;
  const std::vector<JointName>& names_;
  const BoneJoints& joint_;
  const Motion& motion_;
  std::vector<std::string>& notes_;
  std::array<std::optional<Mat>, kBones> known_;
  std::array<std::optional<Mat>, kBones> T_;
  std::array<Evidence, kBones> evidence_;
  double size_ = 0.0;  // length of the thigh; a millionth of it counts as 0
  bool upright_ = false;
  bool legs_folded_ = false;
  Vec zero_up_ = kY;
  UpAxis up_ = UpAxis::kPlusY;
  std::string why_up_;
  std::string up_doubt_;
  bool up_by_zero_pose_ = false;
  Bone top_ = Bone::kHips;  // the trunk bone that carries the arms
  int carrier_ = 0;         // the joint that carries them
  std::optional<Mat> T_chest_;
  std::optional<double> sole_;  // slope from ankle to toes in a standing foot [rad]
  std::string why_sole_;
};

[[nodiscard]] inline Vec outwards(Side side) { return side == Side::kLeft ? kX : Vec(-kX); }
[[nodiscard]] inline std::string_view side_text(Side side) {
  return side == Side::kLeft ? "left" : "right";
}

// Returns `value` with `digits` digits behind the point, for sentences.
[[nodiscard]] std::string short_text(double value, int digits);

}  // namespace posed::rig

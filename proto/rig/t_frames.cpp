#include "proto/rig/t_frames.hpp"

#include <cstdio>

namespace posed::rig {
std::string short_text(double value, int digits) {
  std::array<char, 64> text{};
  (void)std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

Frames::Frames(const Figure& figure, const std::vector<JointName>& names, const BoneJoints& joint,
               const Motion& motion, std::vector<std::string>& notes)
    : figure_(figure), names_(names), joint_(joint), motion_(motion), notes_(notes) {
  const auto thigh = off(Bone::kLeftUpperLeg, Bone::kLeftLowerLeg);
  if (thigh) size_ = thigh->norm();
  if (size_ > 0.0) return;
  for (int j = 1; j < figure_.size(); ++j) size_ = std::max(size_, figure_[j].offset.norm());
}

bool Frames::can_find_person() const {
  if (!joint_.has_limbs() || !joint_.has(Bone::kHips)) return false;
  return std::ranges::all_of(kSides, [this](Side side) {
    const auto hips = joint_[Bone::kHips];
    return rest(on(side, Bone::kLeftUpperLeg), {on(side, Bone::kLeftLowerLeg)}) &&
           rest(on(side, Bone::kLeftUpperArm), {on(side, Bone::kLeftLowerArm)}) &&
           figure_.below(hips, joint_[on(side, Bone::kLeftUpperLeg)]) &&
           figure_.below(hips, joint_[on(side, Bone::kLeftUpperArm)]);
  });
}

void Frames::find_person() {
  pelvis();
  trunk();
  find_up();
  legs();
  arms();
  for (const Side side : kSides) fingers(side);
  check_hinges();
}

void Frames::set(Bone bone, const Mat& T, double sure, std::string why) {
  T_[index(bone)] = known_[index(bone)].value_or(T);
  evidence_[index(bone)] = {.sure = sure, .why = std::move(why)};
}

std::optional<Vec> Frames::off(Bone from, Bone to) const {
  if (!joint_.has(from) || !joint_.has(to)) return std::nullopt;
  return figure_.between(joint_[from], joint_[to]);
}

std::optional<Vec> Frames::rest(Bone bone, std::initializer_list<Bone> after) const {
  for (const Bone next : after) {
    const auto way = off(bone, next);
    if (way && way->norm() > 1e-6 * size_) return way;
  }
  return std::nullopt;
}

std::optional<Vec> Frames::leaf(Bone bone) const {
  if (!joint_.has(bone)) return std::nullopt;
  const int joint = joint_[bone];
  Vec farthest = Vec::Zero();
  const auto look = [&farthest](const Vec& way) {
    if (way.norm() > farthest.norm()) farthest = way;
  };
  for (const int child : figure_.children(joint)) {
    if (!names_[child].helper) look(figure_[child].offset);
  }
  if (figure_[joint].end_site) look(*figure_[joint].end_site);
  return farthest.norm() > 1e-6 * size_ ? std::optional(farthest) : std::nullopt;
}

Bend Frames::bend(Bone upper, Bone lower, Bone end) const {
  const int up = joint_[upper];
  const int low = joint_[lower];
  const Vec along = direction(off(upper, lower).value_or(Vec::Zero()));
  const auto after = rest(lower, {end});
  const Vec along_low = after ? direction(*after) : along;
  Vec sum = Vec::Zero();
  double sizes = 0.0;
  std::vector<double> size;
  for (int i = 0; i < motion_.poses(); ++i) {
    const Vec way = motion_.world(i, up).transpose() * (motion_.world(i, low) * along_low);
    const Vec turn = along.cross(way);
    size.push_back(turn.norm());
    sizes += turn.norm();
    sum += turn;
  }
  return {.axis = direction(sum),
          .flex_deg = std::asin(std::min(1.0, percentile(size, 90))) / kDegree,
          .agree = sum.norm() / std::max(sizes, 1e-9)};
}

double Frames::bent_deg(Bone before, Bone bone, const Mat& T) const {
  const int parent = joint_[before];
  const int joint = joint_[bone];
  const Mat& T_before = *T_[index(before)];
  return motion_.mean([&](int i) {
    const Mat local = motion_.world(i, parent).transpose() * motion_.world(i, joint);
    return turn_deg(T_before.transpose() * T, local);
  });
}

double Frames::leg_length() const {
  const auto thigh = off(Bone::kLeftUpperLeg, Bone::kLeftLowerLeg);
  auto shin = rest(Bone::kLeftLowerLeg, {Bone::kLeftFoot, Bone::kLeftToes});
  if (!shin) shin = leaf(Bone::kLeftLowerLeg);
  const double thigh_length = thigh ? thigh->norm() : 0.0;
  return thigh_length + (shin ? shin->norm() : thigh_length);
}

// How far the axis about which the limb of a left `upper` bone clearly bends is from a person's.
std::optional<double> Frames::bends_off_deg(Bone upper, Side side) const {
  const auto after = [&](int i) {
    return on(side, static_cast<Bone>(static_cast<int>(upper) + i));
  };
  if (!joint_.has(after(2))) return std::nullopt;
  const Bend bent = bend(after(0), after(1), after(2));
  if (bent.flex_deg <= 20 || bent.agree <= 0.7) return std::nullopt;
  const Vec of_arm = side == Side::kLeft ? Vec(-kY) : kY;
  return angle_deg(*t_frame(after(0)) * bent.axis, upper == Bone::kLeftUpperLeg ? kX : of_arm);
}

int Frames::bends_ahead() const {
  constexpr double kClear_deg = 60;
  int ahead = 0;
  int behind = 0;
  for (const Side side : kSides) {
    for (const Bone upper : {Bone::kLeftUpperLeg, Bone::kLeftUpperArm}) {
      const auto off_deg = bends_off_deg(upper, side);
      const bool folded = sure(on(side, upper)) < 1.0;  // its axis was chosen by how it bends
      if (!off_deg || folded) continue;
      ahead += *off_deg < kClear_deg ? 1 : 0;
      behind += *off_deg > 180 - kClear_deg ? 1 : 0;
    }
  }
  if (ahead > 1 && behind == 0) return 1;
  return behind > 1 && ahead == 0 ? -1 : 0;
}

// The limbs of a person bend one way: a clear bend about another axis means that the zero pose is
// not what it seems. It never changes T.
void Frames::check_hinges() {
  for (const Side side : kSides) {
    for (const Bone upper : {Bone::kLeftUpperLeg, Bone::kLeftUpperArm}) {
      const auto off_deg = bends_off_deg(upper, side);
      if (!off_deg || *off_deg <= 60) continue;
      const auto lower = static_cast<Bone>(static_cast<int>(upper) + 1);
      notes_.push_back(std::string(bone_name(on(side, lower))) + " bends about an axis " +
                       short_text(*off_deg, 0) +
                       " degrees from a person's: is its zero pose right?");
    }
  }
  const Vec pelvis = t_frame(Bone::kHips)->transpose() * kY;
  std::vector<double> lean_deg;
  for (int i = 0; i < motion_.poses(); ++i) {
    const Vec up = motion_.world(i, joint_[Bone::kHips]) * pelvis;
    lean_deg.push_back(angle_deg(up_turn(up_) * up, kY));
  }
  if (percentile(lean_deg, 50) > 60) {
    notes_.push_back("the pelvis lies on its side in most frames (" +
                     short_text(percentile(lean_deg, 50), 0) + " degrees)");
  }
}

// Lays a bone of an incomplete figure on its axis by the smallest turn of its parent's T.
void Frames::lay(Bone bone, const Mat& T_parent) {
  const bool left = bone_name(bone).starts_with("left");
  const Side side = left ? Side::kLeft : Side::kRight;
  const auto is = [&](Bone of_left) { return bone == on(side, of_left); };
  const auto after = static_cast<Bone>(static_cast<int>(bone) + 1);
  Mat T = T_parent;
  if (is(Bone::kLeftUpperLeg) || is(Bone::kLeftLowerLeg)) {
    if (const auto way = rest(bone, {after})) T = minimal(T * *way, -kY) * T;
  } else if (is(Bone::kLeftUpperArm) || is(Bone::kLeftLowerArm)) {
    if (const auto way = rest(bone, {after})) T = minimal(T * *way, outwards(side)) * T;
  }
  set(bone, T, 0.5, "the zero pose of an incomplete person");
}

void Frames::lay_parts() {
  const auto bones = joint_.by_joint(figure_.size());
  std::vector<Mat> T(bones.size(), Mat::Identity());
  for (int j = 0; j < figure_.size(); ++j) {
    if (figure_[j].parent >= 0) T[j] = T[figure_[j].parent];
    if (!bones[j]) continue;
    lay(*bones[j], T[j]);
    const bool foot = *bones[j] == Bone::kLeftFoot || *bones[j] == Bone::kRightFoot;
    if (foot) set(*bones[j], Mat::Identity(), 0.5, "flat sole in the zero pose");
    T[j] = *T_[index(*bones[j])];
  }
}

}  // namespace posed::rig

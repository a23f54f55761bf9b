#include "proto/rig/t_frames.hpp"

namespace posed::rig {
namespace {

// The 24 rotations that map axes to axes.
std::vector<Mat> axis_rotations() {
  std::vector<Mat> out;
  for (const Vec& a : kAxes) {
    for (const Vec& b : kAxes) {
      if (std::abs(a.dot(b)) > 0.5) continue;
      Mat& m = out.emplace_back();
      m << a, b, a.cross(b);
    }
  }
  return out;
}

constexpr std::string_view kContinues = "continues the bone below";
constexpr double kUpright_deg = 50;

// How well an axis serves as up of a clip.
struct Score {
  UpAxis up{};
  double stand = 0.0;  // share of the poses in which the trunk is upright
  double above = 0.0;  // in which the hips are as far above the lower foot as those of who sits
  double mean = 0.0;   // of the trunk's part along the axis
};

std::string doubt_of(const Score& other, const Score* zero) {
  const std::string is_so =
      zero == nullptr ? "is folded" : "stands along " + std::string(up_text(zero->up));
  return "which axis points up is not sure: the zero pose " + is_so +
         ", and the trunk points along " + std::string(up_text(other.up)) + " in " +
         short_text(100 * other.stand, 0) +
         " of 100 frames: if the person stands there, say so (up)";
}

std::string stands_otherwise(UpAxis zero, const std::string& but) {
  return "the zero pose stands along " + std::string(up_text(zero)) + ", but " + but +
         ": if the person lies, say which axis points up";
}

}  // namespace

// Left from the hip joints; up from the whole figure, or from the trunk where it is folded.
void Frames::pelvis() {
  const int hips = joint_[Bone::kHips];
  const auto at = [&](Side side, Bone bone) {
    return figure_.between(hips, joint_[on(side, bone)]).value_or(Vec::Zero());
  };
  const auto line_of = [&](Bone bone) -> Vec {
    return at(Side::kLeft, bone) - at(Side::kRight, bone);
  };
  const auto middle_of = [&](Bone bone) -> Vec {
    return (at(Side::kLeft, bone) + at(Side::kRight, bone)) / 2;
  };
  Vec line = line_of(Bone::kLeftUpperLeg);
  if (line.norm() < 1e-6 * size_) line = line_of(Bone::kLeftUpperArm);
  const Vec left = direction(line);
  const Vec head = off(Bone::kHips, Bone::kHead).value_or(middle_of(Bone::kLeftUpperArm));
  Vec up = direction(head);
  upright_ = std::abs(left.dot(up)) < 0.5;
  Vec legs = Vec::Zero();
  for (const Side side : kSides) {
    const Bone foot = joint_.has(on(side, Bone::kLeftFoot)) ? Bone::kLeftFoot : Bone::kLeftLowerLeg;
    const Vec leg = at(side, foot) - at(side, Bone::kLeftUpperLeg);
    upright_ = upright_ && angle_deg(-leg, up) < 60;
    legs += direction(leg);
  }
  if (upright_) {
    up = direction(up - legs);
  } else {
    const auto first = rest(
        Bone::kHips, {Bone::kSpine, Bone::kChest, Bone::kUpperChest, Bone::kNeck, Bone::kHead});
    up = pelvis_up(left, {first.value_or(head), -middle_of(Bone::kLeftUpperLeg), head});
  }
  up = direction(across(up, left));
  zero_up_ = nearest_axis(up, 40).value_or(up);
  line = direction(across(line, zero_up_));
  line = nearest_axis(line, 12).value_or(line);
  set(Bone::kHips, frame(zero_up_, kY, line, kX), upright_ ? 1.0 : 0.9,
      upright_ ? "the figure stands in the zero pose"
               : "hip joints give left, the first spine offset up");
}

// In a folded zero pose: the hint itself where all hints mean one local axis, else the axis that
// stays up in the clip.
Vec Frames::pelvis_up(const Vec& line, const std::vector<Vec>& hints) const {
  std::vector<Vec> good;
  for (const Vec& hint : hints) {
    const Vec rest = across(hint, line);
    if (rest.norm() > 0.05 * size_) good.push_back(direction(rest));
  }
  if (good.empty()) return hints.front();
  const bool agree = std::ranges::all_of(
      good, [&good](const Vec& hint) { return main_axis(hint) == main_axis(good.front()); });
  if (agree) return good.front();
  Mat mean = Mat::Zero();
  for (int i = 0; i < motion_.poses(); ++i) mean += motion_.world(i, joint_[Bone::kHips]);
  mean /= motion_.poses();
  for (const Vec& world : {kY, kZ}) {
    for (const Vec& hint : good) {
      if ((mean * main_axis(hint)).dot(world) > 0.7) return main_axis(hint);
    }
  }
  return good.front();
}

// The joint that carries the arms has a left and an up of its own.
void Frames::find_chest() {
  const auto first = [this](Side side) {
    const Bone shoulder = on(side, Bone::kLeftShoulder);
    return joint_[joint_.has(shoulder) ? shoulder : on(side, Bone::kLeftUpperArm)];
  };
  const auto at = [this](int joint) {
    return figure_.between(carrier_, joint).value_or(Vec::Zero());
  };
  carrier_ = figure_.common({first(Side::kLeft), first(Side::kRight)});
  Vec left = at(first(Side::kLeft));
  Vec right = at(first(Side::kRight));
  if ((left - right).norm() < 1e-6 * size_) {  // collars begin at one point
    left = at(joint_[Bone::kLeftUpperArm]);
    right = at(joint_[Bone::kRightUpperArm]);
  }
  Vec above = (left + right) / 2;
  for (const Bone bone : {Bone::kHead, Bone::kNeck}) {
    if (!joint_.has(bone)) continue;
    const Vec way = at(joint_[bone]);
    if (way.norm() > 1e-6 * size_) above = way;
  }
  if ((left - right).norm() <= 0.02 * size_ || above.norm() <= 1e-6 * size_) return;
  Vec line = direction(left - right);
  line = nearest_axis(line, 12).value_or(line);
  const Vec up = direction(across(above, line));
  T_chest_ = frame(line, kX, nearest_axis(up, 40).value_or(up), kY);
}

void Frames::trunk() {
  find_chest();
  std::vector<Bone> order;
  for (const Bone bone :
       {Bone::kSpine, Bone::kChest, Bone::kUpperChest, Bone::kNeck, Bone::kHead}) {
    if (joint_.has(bone)) order.push_back(bone);
  }
  Bone before = Bone::kHips;
  for (std::size_t i = 0; i < order.size(); ++i) {
    std::optional<Vec> way;
    for (std::size_t next = i + 1; next < order.size() && !way; ++next) {
      way = rest(order[i], {order[next]});
    }
    trunk_bone(before, order[i], way);
    before = order[i];
  }
  for (const Bone bone : {Bone::kSpine, Bone::kChest, Bone::kUpperChest}) {
    if (joint_.has(bone) && figure_.below(joint_[bone], carrier_)) top_ = bone;
  }
}

void Frames::trunk_bone(Bone before, Bone bone, const std::optional<Vec>& way) {
  const Mat& Tp = *t_frame(before);
  Mat now = Tp;
  double sure_now = sure(before);
  std::string why(kContinues);
  const bool chest_is_other = T_chest_ && turn_deg(*T_chest_, Tp) > 60;
  const bool chest_is_upright = T_chest_ && way && angle_deg(*T_chest_ * *way, kY) < kUpright_deg;
  if (bone == Bone::kHead || !way || angle_deg(Tp * *way, kY) < kUpright_deg) {
    if (joint_[bone] == carrier_ && chest_is_other) {
      now = *T_chest_;
      sure_now = 0.9;
      why = "the arms' joints give left, the neck up";
    }
  } else if (chest_is_upright) {
    now = *T_chest_;
    sure_now = 0.9;
    why = "the arms' joints give left, the neck up";
  } else {
    now = minimal(Tp * *way, kY) * Tp;
    sure_now = 0.3;
    why = "laid upright; its twist is a guess";
  }
  if (why == kContinues && chest_is_other && chest_is_upright &&
      bent_deg(before, bone, *T_chest_) + 30 < bent_deg(before, bone, Tp)) {
    now = *T_chest_;
    sure_now = 0.8;
    why = "as the arms' joint: nearer to its parent in the clip";
  }
  if (bone == Bone::kHead) {
    head(before, now, sure_now, why);
  } else {
    set(bone, now, sure_now, why);
  }
}

// In a folded zero pose the head may have a frame of its own. It is looked for only where it shows:
// where the head would be turned by more than 60 degrees on the average.
void Frames::head(Bone before, const Mat& T_now, double sure_now, const std::string& why) {
  const Mat T_before = *t_frame(before);
  if (upright_ || bent_deg(before, Bone::kHead, T_before) < 60) {
    set(Bone::kHead, T_now, sure_now, why);
    return;
  }
  std::vector<std::pair<double, Mat>> turns;
  for (const Mat& turn : axis_rotations()) {
    turns.emplace_back(bent_deg(before, Bone::kHead, T_before * turn), T_before * turn);
  }
  std::ranges::stable_sort(turns, {}, &std::pair<double, Mat>::first);
  const bool clear = turns[0].first < 35 && turns[1].first - turns[0].first > 30;
  if (!clear) notes_.emplace_back("how the head is turned in its joint is not sure");
  set(Bone::kHead, turns[0].second, clear ? 0.8 : 0.3,
      "a frame of its own: as the clip turns it least");
}

// Whether it strides, and over one ground, where `up` is up: who lies still does not stride, and
// who crawls leaves that ground.
bool Frames::walks(const Vec& up) const {
  std::vector<double> ground;
  std::vector<Vec> apart;
  Vec middle = Vec::Zero();
  for (int i = 0; i < motion_.poses(); ++i) {
    const Vec& left = motion_.position(i, foot(Side::kLeft));
    const Vec& right = motion_.position(i, foot(Side::kRight));
    ground.push_back(std::min(left.dot(up), right.dot(up)));
    apart.push_back(across(left - right, up));
    middle += apart.back() / motion_.poses();
  }
  const double half_leg = 0.5 * leg_length();
  const auto [lowest, highest] = std::ranges::minmax(ground);
  return highest - lowest < half_leg &&
         std::ranges::any_of(apart, [&](const Vec& d) { return (d - middle).norm() > half_leg; });
}

int Frames::foot(Side side) const {
  const Bone bone = on(side, Bone::kLeftFoot);
  return joint_[joint_.has(bone) ? bone : on(side, Bone::kLeftLowerLeg)];
}

// Whether `place` of the hips in the file is as high above its origin as those of who is on a floor
// through it.
bool Frames::is_above_floor(const Vec& place, const Vec& up) const {
  const double height = place.dot(up) / leg_length();
  return height > 0.4 && height < 1.6;
}

// The axis along which a folded zero pose has its hips a leg above the file's origin, and nowhere
// else: as of a figure that stands there.
std::optional<UpAxis> Frames::up_by_root() const {
  const Vec place =
      figure_.between(0, joint_[Bone::kHips]).value_or(Vec::Zero()) + figure_[0].offset;
  for (const UpAxis axis : kUpAxes) {
    const Vec up = up_turn(axis).transpose() * kY;
    constexpr double kAside = 0.2;
    const double aside = across(place, up).norm();
    if (place.dot(up) > 0.8 * leg_length() && is_above_floor(place, up) &&
        aside < kAside * leg_length()) {
      return axis;
    }
  }
  return std::nullopt;
}

// +y unless the zero pose stands along another axis, or every sign in the clip speaks against it.
void Frames::find_up() {
  const int hips = joint_[Bone::kHips];
  const Vec pelvis = t_frame(Bone::kHips)->transpose() * kY;
  const double seat = 0.4 * leg_length();  // on a chair hips are a shin above the feet
  std::vector<Score> scores;
  for (const UpAxis axis : kUpAxes) {
    const Vec up = up_turn(axis).transpose() * kY;
    const auto lean = [&](int i) { return (motion_.world(i, hips) * pelvis).dot(up); };
    const auto height = [&](int i, int joint) { return motion_.position(i, joint).dot(up); };
    scores.push_back({.up = axis,
                      .stand = motion_.mean([&](int i) { return lean(i) > 0.7 ? 1.0 : 0.0; }),
                      .above = motion_.mean([&](int i) {
                        const double low =
                            std::min(height(i, foot(Side::kLeft)), height(i, foot(Side::kRight)));
                        return height(i, hips) - low > seat ? 1.0 : 0.0;
                      }),
                      .mean = motion_.mean(lean)});
  }
  const Score* zero = nullptr;
  for (const Score& score : scores) {
    const Vec up = up_turn(score.up).transpose() * kY;
    if (upright_ && zero == nullptr && up.dot(zero_up_) > 0.9) zero = &score;
  }
  const Score& best = *std::ranges::max_element(scores, {}, &Score::mean);
  const bool is_profile = known_[index(Bone::kHips)].has_value();
  const auto by_root = up_by_root();
  const bool root_says = !upright_ && !is_profile && by_root;
  const UpAxis root_up = root_says ? by_root.value_or(UpAxis::kPlusY) : UpAxis::kPlusY;
  const Vec best_up = up_turn(best.up).transpose() * kY;
  const bool stays_above = motion_.mean([&](int i) {
    return is_above_floor(motion_.position(i, hips), best_up) ? 1.0 : 0.0;
  }) > 0.9;
  // What the root says of a zero pose without a frame of its own gives way to the usual axis only.
  const auto expected = [&] {
    if (is_profile) return false;
    if (zero != nullptr) return best_up == kZ && stays_above;
    return stays_above && (!root_says || best.up == root_up || best.up == UpAxis::kPlusY);
  };
  const bool stands = best.stand > 0.9 && best.above > 0.9 && (expected() || walks(best_up));
  const double y_mean = scores.front().mean;
  if (zero != nullptr && zero->mean > 0.3) {
    up_ = zero->up;
    why_up_ = "the zero pose stands along it";
    up_by_zero_pose_ = true;
  } else if (best.up != UpAxis::kPlusY && y_mean < 0.35 && stands) {
    up_ = best.up;
    why_up_ = "the figure stands along it in more than nine frames of ten";
    if (zero != nullptr) {
      notes_.push_back(stands_otherwise(zero->up, "the clip along " + std::string(up_text(up_))));
    }
  } else if (root_up != UpAxis::kPlusY && !stands) {
    up_ = root_up;
    why_up_ = "the hips are a leg above the origin in the zero pose";
  } else {
    const bool z = zero != nullptr && zero->up == UpAxis::kPlusZ && y_mean < 0.3;
    up_ = z ? UpAxis::kPlusZ : UpAxis::kPlusY;
    why_up_ = "as BVH is by default";
    const Score& other =
        *std::max_element(scores.begin() + 1, scores.end(),
                          [](const Score& a, const Score& b) { return a.stand < b.stand; });
    const bool is_known = is_profile || (zero == nullptr && by_root) || other.up == up_;
    if (!is_known && other.stand > 0.3) up_doubt_ = doubt_of(other, zero);
    if (zero != nullptr && zero->up != up_ && !is_profile) {
      up_doubt_ = stands_otherwise(zero->up, "+y is taken, for the clip does not stand");
    }
  }
}

}  // namespace posed::rig

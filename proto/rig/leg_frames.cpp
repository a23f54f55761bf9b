#include "proto/rig/t_frames.hpp"

namespace posed::rig {
namespace {

constexpr std::size_t at(Side side) { return static_cast<std::size_t>(side); }

Vec mirror(const Vec& v) { return {-v.x(), v.y(), v.z()}; }

constexpr double kStraightShin_deg = 15;  // of a figure whose legs are together
constexpr double kToeAside_deg = 20;      // of a foot's outer toes
constexpr double kIntoGround_deg = 25;    // from straight down
constexpr double kSureLateral = 0.75;
constexpr double kOnAxis_deg = 1;

}  // namespace

void Frames::legs() {
  const Mat Th = *t_frame(Bone::kHips);
  Both thigh;
  Both world;
  for (const Side side : kSides) {
    thigh[at(side)] = *off(on(side, Bone::kLeftUpperLeg), on(side, Bone::kLeftLowerLeg));
    world[at(side)] = Th * direction(thigh[at(side)]);
  }
  // Who sits has shins that hang. Straight legs that reach ahead or aside are bones along local
  // axes.
  const auto hangs = [&](Side side) {
    const Bone lower = on(side, Bone::kLeftLowerLeg);
    const double thigh_deg = angle_deg(world[at(side)], -kY);
    auto shin = rest(lower, {on(side, Bone::kLeftFoot), on(side, Bone::kLeftToes)});
    if (!shin) shin = leaf(lower);
    return thigh_deg < 60 || (thigh_deg < 110 && shin && angle_deg(Th * *shin, -kY) < 45);
  };
  const bool real =
      angle_deg(mirror(world[0]), world[1]) < 25 && std::ranges::all_of(kSides, hangs);
  const auto toes = std::array{toe_way(Side::kLeft), toe_way(Side::kRight)};
  // Toes that point into the ground show that the axes of the legs are their own.
  const bool into_ground =
      toes[0] && toes[1] &&
      std::min(angle_deg(Th * *toes[0], -kY), angle_deg(Th * *toes[1], -kY)) < kIntoGround_deg;
  if (!real || into_ground) {
    folded_legs(thigh);
    return;
  }
  if (legs_by_feet(thigh)) return;
  for (const Side side : kSides) {
    leg(side, minimal(world[at(side)], -kY) * Th, 1.0, "zero pose");
    real_foot(side, sure(on(side, Bone::kLeftLowerLeg)), false);
  }
}

// Feet that both point aside say where forward is in the legs' own frames. Tips alone do not: an
// end site may be anywhere. What points down points nowhere.
bool Frames::legs_by_feet(const Both& thigh) {
  const Mat Th = *t_frame(Bone::kHips);
  const auto toes = std::array{toe_way(Side::kLeft), toe_way(Side::kRight)};
  if (!toes[0] || !toes[1]) return false;
  const auto aside_deg = [&Th](const Vec& toes_way) {
    const Vec way = Th * toes_way;
    const bool is_down = angle_deg(way, -kY) < kIntoGround_deg;
    return is_down ? 0.0 : std::atan2(way.x(), way.z()) / kDegree;
  };
  const auto point_aside = [&](const Both& ways) {
    const double left_deg = aside_deg(ways[0]);
    const double right_deg = aside_deg(ways[1]);
    return std::max(std::abs(left_deg), std::abs(right_deg)) > 75 ||
           std::abs(left_deg + right_deg) > 60;
  };
  const Both to_joints{*off(Bone::kLeftFoot, Bone::kLeftToes),
                       *off(Bone::kRightFoot, Bone::kRightToes)};
  if (!point_aside({*toes[0], *toes[1]}) || !point_aside(to_joints)) return false;
  for (const Side side : kSides) {
    leg(side, frame(thigh[at(side)], -kY, *toes[at(side)], kZ), 0.9, "the foot gives forward");
    real_foot(side, sure(on(side, Bone::kLeftLowerLeg)), true);
  }
  return true;
}

void Frames::folded_legs(const Both& thigh) {
  legs_folded_ = true;
  std::array found{laterals(Side::kLeft, thigh[0]), laterals(Side::kRight, thigh[1])};
  // One lateral axis for both legs where their bones lie along one local axis: makers mirror by it.
  const auto left = nearest_axis(direction(thigh[0]), 10);
  const auto right = nearest_axis(direction(thigh[1]), 10);
  if (left && right && std::abs(left->dot(*right)) > 0.9) {
    for (std::size_t k = 0; k < found[0].size(); ++k) {
      found[0][k].score = (found[0][k].score + found[1][k].score) / 2;
      found[1][k].score = found[0][k].score;
    }
  }
  for (const Side side : kSides) {
    auto& order = found[at(side)];
    std::ranges::stable_sort(order, std::greater{}, &Lateral::score);
    const double best = order[0].score;
    const double second = order.size() > 1 ? order[1].score : -1.0;
    const bool clear = best > 0.7 && best - second > 0.35;
    if (!clear) {
      notes_.push_back("the zero pose is folded, and nothing shows how the " +
                       std::string(side_text(side)) +
                       " leg is twisted: use a clip in which the knees bend");
    }
    leg(side, frame(thigh[at(side)], -kY, order[0].axis, kX), clear ? 0.9 : 0.2,
        "bone axis and knee (" + short_text(best, 2) + ", next best " + short_text(second, 2) +
            ")");
  }
  for (const Side side : kSides) folded_foot(side, sure(on(side, Bone::kLeftLowerLeg)));
}

// Each local axis across the thigh: does the knee bend about it, forwards, and does it stay with
// the pelvis' left?
std::vector<Frames::Lateral> Frames::laterals(Side side, const Vec& thigh) const {
  const int hips = joint_[Bone::kHips];
  const int joint = joint_[on(side, Bone::kLeftUpperLeg)];
  const Vec left = t_frame(Bone::kHips)->transpose() * kX;
  const Bend knee =
      bend(on(side, Bone::kLeftUpperLeg), on(side, Bone::kLeftLowerLeg), on(side, Bone::kLeftFoot));
  const double trust = std::clamp((knee.flex_deg - 5) / 15, 0.0, 1.0) *
                       std::clamp((knee.agree - 0.6) / 0.3, 0.0, 1.0);
  std::vector<Lateral> out;
  for (const Vec& axis : axes_across(thigh)) {
    const double stays = motion_.mean(
        [&](int i) { return (motion_.world(i, joint) * axis).dot(motion_.world(i, hips) * left); });
    out.push_back({.axis = axis, .score = trust * knee.axis.dot(axis) + (1 - trust) * stays});
  }
  return out;
}

void Frames::leg(Side side, const Mat& T_thigh, double sure_leg, const std::string& why) {
  const Bone lower = on(side, Bone::kLeftLowerLeg);
  set(on(side, Bone::kLeftUpperLeg), T_thigh, sure_leg, why);
  const auto shin = rest(lower, {on(side, Bone::kLeftFoot), on(side, Bone::kLeftToes)});
  if (shin && angle_deg(T_thigh * *shin, -kY) > 110) {
    set(lower, minimal(T_thigh * *shin, -kY) * T_thigh, std::min(sure_leg, 0.3),
        "the shin is folded against the thigh; its twist is a guess");
    return;
  }
  set(lower, shin ? Mat(minimal(T_thigh * *shin, -kY) * T_thigh) : T_thigh, sure_leg, why);
}

// A figure that stands has flat soles, also where its legs are apart, unless the foot itself shows
// that it was laid along the shin.
void Frames::real_foot(Side side, double sure_foot, bool by_feet) {
  const Bone foot = on(side, Bone::kLeftFoot);
  const Bone lower = on(side, Bone::kLeftLowerLeg);
  if (!joint_.has(foot)) return;
  const Mat Tl = *t_frame(lower);
  const Mat Th = by_feet ? *t_frame(on(side, Bone::kLeftUpperLeg)) : *t_frame(Bone::kHips);
  const auto way = rest(lower, {foot});
  Mat Tf = Th;
  std::string why_foot = "flat sole in the zero pose";
  const double slant_deg = way ? angle_deg(Th * *way, -kY) : 0.0;
  const Sole sole = slant_deg > 3 ? sole_of(side, Th, Tl) : Sole::kFlat;
  if (sole == Sole::kAlongShin) {
    Tf = Tl;
    why_foot = "goes with the shin";
  } else if (sole == Sole::kUnclear && slant_deg >= kStraightShin_deg) {
    sure_foot = std::min(sure_foot, 0.4);
    why_foot = "legs apart in the zero pose: the sole is taken for flat";
  }
  const auto toes = toe_way(side);
  if (toes && angle_deg(Tf * *toes, kZ) > 75) {
    Tf = minimal(Tf * *toes, kZ) * Tf;
    sure_foot = 0.4;
    why_foot = "the zero pose hides the sole: ankle to toes laid level";
  }
  set(foot, Tf, sure_foot, why_foot);
  if (joint_.has(on(side, Bone::kLeftToes))) {
    set(on(side, Bone::kLeftToes), Tf, sure_foot, "goes with the foot");
  }
}

// Of a folded foot, the local axis that stays nearest to the shin's lateral one.
Frames::Lateral Frames::foot_lateral(Side side, const Vec& way) const {
  const int foot = joint_[on(side, Bone::kLeftFoot)];
  const int shin = joint_[on(side, Bone::kLeftLowerLeg)];
  const Vec left = t_frame(on(side, Bone::kLeftLowerLeg))->transpose() * kX;
  Lateral best{.axis = kX, .score = -2.0};
  for (const Vec& axis : axes_across(way)) {
    const double score = motion_.mean(
        [&](int i) { return (motion_.world(i, foot) * axis).dot(motion_.world(i, shin) * left); });
    if (score > best.score) best = {.axis = axis, .score = score};
  }
  return best;
}

// Ahead in a folded foot: the way to the toes. Where bones lie along local axes, its part aside is
// the place of one toe and no turn of the foot, unless that is too much for a toe.
std::optional<Vec> Frames::folded_way(Side side) const {
  const auto way = foot_way(side);
  if (!way) return std::nullopt;
  const auto shin = rest(on(side, Bone::kLeftLowerLeg), {on(side, Bone::kLeftFoot)});
  const Lateral lateral = foot_lateral(side, *way);
  const bool is_toe = std::abs(way->dot(lateral.axis)) < std::sin(kToeAside_deg * kDegree) &&
                      shin && nearest_axis(direction(*shin), kOnAxis_deg);
  return is_toe && lateral.score > kSureLateral ? direction(across(*way, lateral.axis)) : *way;
}

// The sole of a folded foot slopes as in standing feet of the clip, else as a foot of this length
// does.
void Frames::folded_foot(Side side, double sure_leg) {
  const Bone foot = on(side, Bone::kLeftFoot);
  if (!joint_.has(foot)) return;
  const Mat Tl = *t_frame(on(side, Bone::kLeftLowerLeg));
  Mat Tf = Tl;
  double sure_foot = 0.3;
  std::string why = "a foot without length: goes with the shin";
  if (const auto way = folded_way(side)) {
    if (why_sole_.empty()) find_sole();
    const double guess =
        std::asin(std::min(0.6, 0.075 * leg_length() / std::max(foot_length(side), 1e-9)));
    const double slope = sole_.value_or(guess);
    const Lateral best = foot_lateral(side, *way);
    Tf = frame(*way, Vec(0, -std::sin(slope), std::cos(slope)), best.axis, kX);
    sure_foot =
        (sole_ ? sure_leg : std::min(sure_leg, 0.4)) * (best.score > kSureLateral ? 1.0 : 0.4);
    why = "folded foot: ankle to toes sloped " + short_text(slope / kDegree, 0) + " degrees " +
          why_sole_;
  }
  set(foot, Tf, sure_foot, why);
  if (joint_.has(on(side, Bone::kLeftToes))) {
    set(on(side, Bone::kLeftToes), Tf, sure_foot, "goes with the foot");
  }
}

std::optional<Vec> Frames::foot_way(Side side) const {
  auto way = rest(on(side, Bone::kLeftFoot), {on(side, Bone::kLeftToes)});
  if (!way) way = leaf(on(side, Bone::kLeftFoot));
  return way ? std::optional(direction(*way)) : std::nullopt;
}

// Of a foot below a slanting shin: is its sole flat, or did its maker lay it along the shin? Ankle,
// toes and their one tip lie in the foot's upright plane, and the tip is level. A foot that does
// not show this but lies exactly in the shin's plane was laid along it. Toes that are turned out a
// little must not pass for either.
Frames::Sole Frames::sole_of(Side side, const Mat& T_flat, const Mat& T_shin) const {
  const auto way = foot_way(side);
  if (!way) return Sole::kUnclear;
  const auto tip = leaf(on(side, Bone::kLeftToes));
  const int toes = joint_[on(side, Bone::kLeftToes)];
  const bool one_tip = tip && figure_.children(toes).size() <= 1;
  const Vec plane = one_tip ? Vec(way->cross(direction(*tip))) : Vec(Vec::Zero());
  if (plane.norm() > std::sin(5 * kDegree)) {
    const auto off_deg = [&](const Mat& T) {
      return std::abs(90 - angle_deg(T * plane, kY)) + std::abs(90 - angle_deg(T * *tip, kY));
    };
    const double flat_deg = off_deg(T_flat);
    const double shin_deg = off_deg(T_shin);
    if (flat_deg < 3 && shin_deg > flat_deg + 5) return Sole::kFlat;
    if (shin_deg < 3 && flat_deg > shin_deg + 5) return Sole::kAlongShin;
  }
  const double flat = std::abs((T_flat * *way).x());
  const double shin = std::abs((T_shin * *way).x());
  if (flat < 0.02 && shin > 0.04) return Sole::kFlat;
  return shin < 0.005 && flat > 0.02 ? Sole::kAlongShin : Sole::kUnclear;
}

// From the ankle to the farthest point of the toes. An end site without a toe joint proves nothing.
std::optional<Vec> Frames::toe_way(Side side) const {
  const auto way = rest(on(side, Bone::kLeftFoot), {on(side, Bone::kLeftToes)});
  if (!way) return std::nullopt;
  return direction(*way + leaf(on(side, Bone::kLeftToes)).value_or(Vec::Zero()));
}

double Frames::foot_length(Side side) const {
  const auto way = rest(on(side, Bone::kLeftFoot), {on(side, Bone::kLeftToes)});
  return way ? way->norm() : leaf(on(side, Bone::kLeftFoot)).value_or(Vec::Zero()).norm();
}

// One slope for both feet; none where the clip does not show it.
void Frames::find_sole() {
  why_sole_ = "by its length, which is a guess";
  if (motion_.poses() < 30) return;
  std::vector<double> slopes;
  for (const Side side : kSides) add_slopes(side, slopes);
  if (slopes.size() < 6) return;
  const double low = percentile(slopes, 25);
  const double middle = percentile(slopes, 50);
  const double high = percentile(slopes, 75);
  if (high - low > 12 * kDegree || middle <= -5 * kDegree || middle >= 55 * kDegree) return;
  sole_ = middle;
  why_sole_ = "in the frames in which a foot stands";
}

// Adds the slope from ankle to toes of each frame in which the foot is low and slow [rad].
void Frames::add_slopes(Side side, std::vector<double>& slopes) const {
  const auto way = folded_way(side);
  if (!way) return;
  const int joint = joint_[on(side, Bone::kLeftFoot)];
  const Vec up = up_turn(up_).transpose() * kY;
  const double length = foot_length(side);
  const auto ahead = [&](int i) -> Vec { return motion_.world(i, joint) * *way; };
  const auto ankle = [&](int i) { return motion_.position(i, joint); };
  const auto toes = [&](int i) -> Vec { return ankle(i) + ahead(i) * length; };
  const int last = motion_.poses() - 1;
  std::vector<double> speed;  // per frame
  std::vector<double> height;
  for (int i = 0; i <= last; ++i) {
    const int from = std::max(i - 1, 0);
    const int to = std::min(i + 1, last);
    speed.push_back(((toes(to) - toes(from)).norm() + (ankle(to) - ankle(from)).norm()) /
                    (to - from));
    height.push_back((ankle(i) + toes(i)).dot(up) / 2);
  }
  const double low = percentile(height, 5) + 0.06 * leg_length();
  const double slow = percentile(speed, 25);
  for (int i = 0; i <= last; ++i) {
    if (height[i] < low && speed[i] <= slow) {
      slopes.push_back(-std::asin(std::clamp(ahead(i).dot(up), -1.0, 1.0)));
    }
  }
}

}  // namespace posed::rig

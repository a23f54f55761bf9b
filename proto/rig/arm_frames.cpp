#include "proto/rig/t_frames.hpp"

namespace posed::rig {
namespace {

constexpr std::size_t which(Side side) { return static_cast<std::size_t>(side); }
constexpr Side opposite(Side side) { return side == Side::kLeft ? Side::kRight : Side::kLeft; }

Vec mirrored_x(const Vec& v) { return {-v.x(), v.y(), v.z()}; }

}  // namespace

void Frames::arms() {
  const Mat Tc = *t_frame(top_);
  Both way;
  std::array<std::optional<Vec>, 2> palms;
  for (const Side side : kSides) {
    way[which(side)] = *off(on(side, Bone::kLeftUpperArm), on(side, Bone::kLeftLowerArm));
    palms[which(side)] = palm(side);
  }
  if (arms_are_real(way, palms)) {
    for (const Side side : kSides) {
      arm(side, minimal(Tc * way[which(side)], outwards(side)) * Tc, 1.0, "zero pose", false);
    }
  } else if (palms[0] && palms[1] && !(elbows_tell(way) && palms_are_thumbs())) {
    for (const Side side : kSides) {
      const Vec& along = way[which(side)];
      const Vec& palm = *palms[which(side)];
      // A bone along a local axis has its hinge along another; a palm is flat, but not to a degree.
      const bool has_axes = nearest_axis(direction(along), 10).has_value();
      const double limit_deg = palms_are_thumbs() ? 35 : 15;
      const auto axis = has_axes ? nearest_axis(palm, limit_deg) : std::nullopt;
      const bool is_guess = palms_are_thumbs() && !axis;
      arm(side, frame(along, outwards(side), axis.value_or(palm), kZ), is_guess ? 0.4 : 0.9,
          palms_are_thumbs() ? "bone axis and the thumb" : "bone axis and the order of the fingers",
          true);
    }
  } else {
    arms_by_elbows(way);
  }
}

bool Frames::elbows_tell(const Both& way) const {
  return std::ranges::all_of(
      kSides, [&](Side side) { return hinge(side, way[which(side)], std::nullopt).has_value(); });
}

// Whether a hand has so few fingers that only the thumb shows its palm.
bool Frames::palms_are_thumbs() const {
  return std::ranges::any_of(kSides, [this](Side side) {
    return !joint_.has(on(side, Bone::kLeftIndexProximal)) ||
           (!joint_.has(on(side, Bone::kLeftRingProximal)) &&
            !joint_.has(on(side, Bone::kLeftLittleProximal)));
  });
}

// Whether the arms, though unlike, are those of somebody who stands: both at their sides in the
// plane of the chest, and one of them along no axis, as a folded one would be.
bool Frames::arms_slant(const Both& way, const Vec& left, const Vec& right) const {
  constexpr double kAxis_deg = 10, kAhead = 0.35;  // the latter of a direction: 20 degrees
  const bool at_sides =
      left.x() > 0 && right.x() < 0 && std::max(std::abs(left.z()), std::abs(right.z())) < kAhead;
  const bool slants = std::ranges::any_of(
      way, [](const Vec& arm) { return !nearest_axis(direction(arm), kAxis_deg).has_value(); });
  return at_sides && slants && !legs_folded_;
}

// Whether the arms of the zero pose hang or reach as a person's do.
bool Frames::arms_are_real(const Both& way, const std::array<std::optional<Vec>, 2>& palms) const {
  const Mat Tc = *t_frame(top_);
  const Vec left = Tc * direction(way[0]);
  const Vec right = Tc * direction(way[1]);
  if (angle_deg(mirrored_x(left), right) >= 25 && !arms_slant(way, left, right)) return false;
  constexpr double kUp_deg = 25;  // folded arms go on as the trunk does
  double palm_off_deg = 0.0;
  double least_raise_deg = 180.0;
  for (const Side side : kSides) {
    const Vec arm_way = side == Side::kLeft ? left : right;
    const auto collar = rest(on(side, Bone::kLeftShoulder), {on(side, Bone::kLeftUpperArm)});
    const double raise_deg = angle_deg(arm_way, outwards(side));
    if (raise_deg >= 120 || angle_deg(arm_way, kY) <= kUp_deg) return false;
    if (collar && angle_deg(Tc * *collar, outwards(side)) >= 65) return false;
    least_raise_deg = std::min(least_raise_deg, raise_deg);
    if (const auto& across_palm = palms[which(side)]) {
      const Vec raised = minimal(arm_way, outwards(side)) * Tc * *across_palm;
      palm_off_deg = std::max(palm_off_deg, angle_deg(raised, kZ));
    }
  }
  // Where the legs are folded the zero pose is no stance, so hanging arms prove nothing; palms do.
  if (!palms[0] || !palms[1]) return !legs_folded_;
  return palm_off_deg <= 75 || (least_raise_deg <= 60 && !legs_folded_);
}

void Frames::arms_by_elbows(const Both& way) {
  std::array<std::optional<Vec>, 2> found;
  for (const Side side : kSides) found[which(side)] = hinge(side, way[which(side)], std::nullopt);
  std::optional<Side> borrowed;
  for (const Side side : kSides) {
    auto& mine = found[which(side)];
    const auto& theirs = found[which(opposite(side))];
    if (!mine && theirs) mine = hinge(side, way[which(side)], theirs);
    if (!mine && theirs && std::abs(direction(way[0]).dot(direction(way[1]))) > 0.9) {
      // Makers mirror so that both elbows bend about one local axis, but not all of them do.
      mine = theirs;
      borrowed = side;
      notes_.push_back("the twist of the " + std::string(side_text(side)) +
                       " arm is taken from the other arm");
    }
  }
  if (!found[0] || !found[1]) {
    notes_.emplace_back(
        "the zero pose is folded and the elbows do not show how the arms are twisted: use a clip "
        "in which they bend");
  }
  for (const Side side : kSides) {
    const auto& axis = found[which(side)];
    const Vec to = side == Side::kLeft ? Vec(-kY) : kY;
    const Vec& along = way[which(side)];
    if (!axis) {
      arm(side, frame(along, outwards(side), axes_across(along).front(), to), 0.2,
          "folded zero pose; the elbow does not tell its hinge", true);
    } else {
      const bool is_borrowed = borrowed == side;
      arm(side, frame(along, outwards(side), *axis, to), is_borrowed ? 0.4 : 0.9,
          is_borrowed ? "bone axis; the hinge is taken from the other arm"
                      : "bone axis and elbow hinge",
          true);
    }
  }
}

// The local axis about which the elbow bends. `like`: the other side's sure one, which allows more
// scatter where this one lies on the same line.
std::optional<Vec> Frames::hinge(Side side, const Vec& way, const std::optional<Vec>& like) const {
  const Bend elbow =
      bend(on(side, Bone::kLeftUpperArm), on(side, Bone::kLeftLowerArm), on(side, Bone::kLeftHand));
  const auto axes = axes_across(way);
  const Vec axis =
      *std::ranges::max_element(axes, {}, [&elbow](const Vec& a) { return a.dot(elbow.axis); });
  const double limit_deg = like && std::abs(like->dot(axis)) > 0.9 ? 43 : 32;
  const bool clear =
      elbow.flex_deg >= 12 && elbow.agree >= 0.8 && angle_deg(axis, elbow.axis) <= limit_deg;
  return clear ? std::optional(axis) : std::nullopt;
}

// In the hand's frame: from the little finger's side to the index's, or where the thumb points.
std::optional<Vec> Frames::palm(Side side) const {
  const Bone hand = on(side, Bone::kLeftHand);
  const auto forearm = rest(on(side, Bone::kLeftLowerArm), {hand});
  if (!forearm) return std::nullopt;
  const auto index_off = off(hand, on(side, Bone::kLeftIndexProximal));
  auto little = off(hand, on(side, Bone::kLeftLittleProximal));
  if (!index_off || !little) little = off(hand, on(side, Bone::kLeftRingProximal));
  Vec way = Vec::Zero();
  if (index_off && little && (*index_off - *little).norm() > 1e-6 * size_) {
    way = *index_off - *little;
  } else {
    const Bone thumb = on(side, Bone::kLeftThumbMetacarpal);
    const auto first = off(hand, thumb);
    if (!first) return std::nullopt;
    way = *first + figure_[joint_[thumb]].end_site.value_or(Vec::Zero());
    way = off(hand, on(side, Bone::kLeftThumbProximal)).value_or(way);
  }
  way = across(way, direction(*forearm));
  return way.norm() > 0.01 * size_ ? std::optional(direction(way)) : std::nullopt;
}

void Frames::arm(Side side, const Mat& T_arm, double sure_arm, const std::string& why,
                 bool folded) {
  const Bone shoulder = on(side, Bone::kLeftShoulder);
  const Bone hand = on(side, Bone::kLeftHand);
  const Vec out = outwards(side);
  if (joint_.has(shoulder)) {
    const auto collar = rest(shoulder, {on(side, Bone::kLeftUpperArm)});
    const Mat& T_chest = *t_frame(top_);
    const Mat laid = collar ? Mat(minimal(T_arm * *collar, out) * T_arm) : T_chest;
    const double with_arm = bent_deg(top_, shoulder, laid) - bent_deg(top_, shoulder, T_chest);
    const bool lies = collar && angle_deg(T_chest * *collar, out) <= 65;
    if (folded && collar && (with_arm < -30 || (!lies && with_arm <= 30))) {
      set(shoulder, laid, sure_arm, why);
    } else {
      set(shoulder, T_chest, sure_arm, "goes with the chest");
    }
  }
  set(on(side, Bone::kLeftUpperArm), T_arm, sure_arm, why);
  const auto forearm = rest(on(side, Bone::kLeftLowerArm), {hand});
  const Mat Tl = forearm ? Mat(minimal(T_arm * *forearm, out) * T_arm) : T_arm;
  set(on(side, Bone::kLeftLowerArm), Tl, sure_arm, why);
  if (!joint_.has(hand)) return;
  const auto palm_way =
      rest(hand, {on(side, Bone::kLeftMiddleProximal), on(side, Bone::kLeftIndexProximal),
                  on(side, Bone::kLeftRingProximal)});
  const double off_deg = palm_way ? angle_deg(Tl * *palm_way, out) : 0.0;
  const bool own = off_deg > 45 && off_deg < 120;
  set(hand, own ? Mat(minimal(Tl * *palm_way, out) * Tl) : Tl, sure_arm, "goes with the forearm");
}

// Straight fingers; the thumb goes with the hand.
void Frames::fingers(Side side) {
  for (int finger = 0; finger < kFingers; ++finger) {
    Bone before = on(side, Bone::kLeftHand);
    for (int i = 0; i < kFingerJoints; ++i) {
      const auto bone_at = [&](int k) {
        return on(side, static_cast<Bone>(static_cast<int>(Bone::kLeftThumbMetacarpal) +
                                          kFingerJoints * finger + k));
      };
      const Bone bone = bone_at(i);
      if (!joint_.has(bone) || !t_frame(before)) continue;
      std::optional<Vec> way;
      for (int k = i + 1; k < kFingerJoints && !way; ++k) way = rest(bone, {bone_at(k)});
      Mat now = *t_frame(before);
      if (finger > 0 && way) now = minimal(now * *way, outwards(side)) * now;
      set(bone, now, sure(before), finger > 0 ? "straight fingers" : "goes with the hand");
      before = bone;
    }
  }
}

// A hand without an arm: along the middle finger, the palm by the order of the fingers.
void Frames::find_hand(Side side) {
  const Bone hand = on(side, Bone::kLeftHand);
  std::vector<Vec> bases;
  Vec sum = Vec::Zero();
  for (const Bone bone : {Bone::kLeftIndexProximal, Bone::kLeftMiddleProximal,
                          Bone::kLeftRingProximal, Bone::kLeftLittleProximal}) {
    if (const auto base = off(hand, on(side, bone))) {
      bases.push_back(*base);
      sum += *base;
    }
  }
  const Vec along = off(hand, on(side, Bone::kLeftMiddleProximal)).value_or(sum);
  if (bases.size() < 2 || along.norm() <= 0.0) return;
  // No finger lies along the hand's axis to a degree.
  const Vec ahead = nearest_axis(direction(along), 12).value_or(direction(along));
  const Vec to_index = direction(across(bases.front() - bases.back(), ahead));
  set(hand, frame(ahead, outwards(side), nearest_axis(to_index, 12).value_or(to_index), kZ), 0.9,
      "along the middle finger, the palm by the order of the fingers");
  fingers(side);
}

// From the wrist to the tip of the middle finger.
double Frames::hand_length(Side side) const {
  const Bone hand = on(side, Bone::kLeftHand);
  const Bone middle = on(side, Bone::kLeftMiddleProximal);
  const auto base = off(hand, middle);
  double length = base ? base->norm() : 0.0;
  const int first = joint_[joint_.has(middle) ? middle : hand];
  for (const double segment : figure_.segments(figure_.main_chain(first))) length += segment;
  return length;
}

}  // namespace posed::rig

#include "models/robot/robot_hand.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "models/robot/shapes.hpp"
#include "models/robot/which_hand.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/lower.hpp"
#include "proto/text/named_numbers.hpp"

namespace posed::robot {
namespace {

constexpr double kDefaultSpeed_rad_s = 8.0;
constexpr std::size_t kMaxShapes = 256;  // each becomes up to four capsules, which all are compared
constexpr double kMaxNamed_rad = 100.0;  // that a text may name
constexpr double kSameWay = 0.97;        // cosine: fingers side by side point so
constexpr double kAlike = 0.01;  // of that mean cosine: no finger points away more than that
constexpr double kMaxFinger_m = 0.3;
constexpr double kSamePlace_m = 1e-3;
constexpr double kBends_m = 1e-3;       // tips that go less far to a side of the palm bend to both
constexpr double kGuessedTip_m = 8e-3;  // radius of a finger tip without a shape

constexpr const char* kNoGripper =
    "; posed drives hands, whose thumb and fingers bend by themselves: let a client of your own "
    "open and close it by the gap of the hand's thumb and index tips";

// Rounds a limit inwards to a float, so that no angle of a frame is beyond it by its own rounding.
double low_float(double value) {
  auto f = static_cast<float>(value);
  if (static_cast<double>(f) < value) f = std::nextafter(f, std::numeric_limits<float>::infinity());
  return static_cast<double>(f);
}
double high_float(double value) { return -low_float(-value); }

std::vector<std::string> split(std::string_view text) {
  std::vector<std::string> words;
  while (!text.empty()) {
    const auto comma = std::min(text.find(','), text.size());
    std::string_view word = text.substr(0, comma);
    while (!word.empty() && word.front() == ' ') word.remove_prefix(1);
    while (!word.empty() && word.back() == ' ') word.remove_suffix(1);
    if (!word.empty()) words.emplace_back(word);
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return words;
}

class Builder {
 public:
  // Of the hand below the link `above` alone.
  Builder(Urdf urdf, const RobotOptions& options, const std::string& file, int above = 0)
      : options_(options), file_(file), above_(above) {
    hand_.name = urdf.name;
    hand_.by_visuals = urdf.by_visuals;
    hand_.links = std::move(urdf.links);
  }

  // Its joints, fingers and side; no shapes.
  Result<RobotHand> build_bare() {
    TRY(list_joints());
    remark_unlimited();
    TRY(list_fingers());
    TRY(hold_shared());
    TRY(hold_named());
    TRY(connect());
    TRY(derive_frame());
    return std::move(hand_);
  }

  Result<RobotHand> build() {
    hand_ = TRY(build_bare());
    add_shapes(hand_);
    for (Finger& finger : hand_.fingers) {
      finger.tip_radius_m = tip_radius(finger);
      finger.tip_shaped = finger.tip_radius_m > 0.0;
      if (!finger.tip_shaped) finger.tip_radius_m = kGuessedTip_m;
    }
    return std::move(hand_);
  }

 private:
  [[nodiscard]] std::unexpected<Error> refuse(const std::string& sentence) const {
    return misuse(sentence, file_);
  }
  [[nodiscard]] int find_joint(const std::string& name) const {
    const auto at = std::ranges::find(hand_.joints, name, &RobotJoint::name);
    return at == hand_.joints.end() ? -1 : static_cast<int>(at - hand_.joints.begin());
  }
  [[nodiscard]] bool is_above(int above, int link) const {
    for (; link >= 0; link = hand_.links[link].parent) {
      if (link == above) return true;
    }
    return false;
  }

  Result<> list_joints() {
    if (hand_.links.size() > static_cast<std::size_t>(kMaxJoints)) {
      return refuse("the robot has " + std::to_string(hand_.links.size()) +
                    " links; posed drives hands of at most 96: leave out those that carry no hand");
    }
    std::size_t shapes = 0;
    for (const Link& link : hand_.links) shapes += link.shapes.size();
    if (shapes > kMaxShapes) {
      return refuse("its links have " + std::to_string(shapes) +
                    " collision shapes; posed keeps at most 256 apart: simplify them");
    }
    hand_.joint_of_link.assign(hand_.links.size(), -1);
    for (int l = 1; l < std::ssize(hand_.links); ++l) {
      const Link& link = hand_.links[l];
      if (!link.turns) continue;
      const bool given = options_.speed > 0.0;
      const double most = given ? options_.speed : kDefaultSpeed_rad_s;
      // A URDF that names no speed leaves it to the config.
      const double speed = given && link.speed == 0.0 ? most : std::min(link.speed, most);
      hand_.joint_of_link[l] = static_cast<int>(hand_.joints.size());
      hand_.joints.push_back({.link = l,
                              .name = link.joint,
                              .low = low_float(link.low),
                              .high = high_float(link.high),
                              .speed = speed});
      RobotJoint& joint = hand_.joints.back();
      joint.high = std::max(joint.high, joint.low);
    }
    if (hand_.joints.empty()) {
      const auto sliding = std::ranges::count_if(hand_.links, &Link::slides);
      if (sliding == 0) return refuse("the URDF has no joint that turns: it is no hand");
      return refuse("the robot is a gripper: " +
                    (sliding == 1
                         ? "its one joint slides"
                         : "its " + std::to_string(sliding) + " joints slide, and none turns") +
                    kNoGripper);
    }
    return {};
  }

  // A finger is a joint that carries no other one that turns, with all between it and the palm.
  Result<> list_fingers() {
    std::vector<int> lasts;
    for (const RobotJoint& joint : hand_.joints) {
      const bool carries = std::ranges::any_of(hand_.joints, [&](const RobotJoint& other) {
        return other.link != joint.link && is_above(joint.link, other.link);
      });
      if (!carries && is_above(above_, joint.link)) lasts.push_back(joint.link);
    }
    open_at_zero();
    place_open();
    for (const int last : lasts) {
      hand_.fingers.push_back({.last = last, .tip = tip_link(last)});
    }
    TRY(choose_tips());
    TRY(refuse_gripper());
    if (options_.tips.empty()) leave_out_rods();
    if (hand_.fingers.size() < 3 || hand_.fingers.size() > 5) return refuse(number_of_fingers());
    for (Finger& finger : hand_.fingers) {
      finger.base = base_of(finger);
      find_end(finger);
    }
    for (const Finger& finger : hand_.fingers) {
      if (finger.base == 0) return refuse("one finger of the robot has no joint of its own");
    }
    open_fists();
    if (options_.tips.empty()) TRY(order_fingers());
    number_fingers();
    return {};
  }

  void number_fingers() {
    for (std::size_t f = 0; f < hand_.fingers.size(); ++f) {
      hand_.fingers[f].human = static_cast<int>(f);
    }
  }

  // Of joints whose <limit> gives no angles.
  void remark_unlimited() {
    std::vector<std::string> stand, follow;
    for (const RobotJoint& joint : hand_.joints) {
      const Link& link = hand_.links[joint.link];
      if (link.unlimited) (link.leader < 0 ? stand : follow).push_back(in_quotes(joint.name));
    }
    const std::string why = "the <limit> has neither lower nor upper of ";
    if (!stand.empty()) {
      hand_.remarks.push_back(why + joined(stand) +
                              ", which a URDF means as 0 for both, so that it stands at 0: give "
                              "the angles between which it turns");
    }
    if (!follow.empty()) {
      hand_.remarks.push_back(why + joined(follow) + ", so that the joint it follows limits it");
    }
  }

  // One joint that moves all chains, which follow it, leaves a thumb nothing to do of its own.
  Result<> refuse_gripper() const {
    int driver = -1;
    for (const RobotJoint& joint : hand_.joints) {
      const auto moved = std::ranges::count_if(
          hand_.fingers, [&](const Finger& one) { return is_above(joint.link, one.tip); });
      const bool is_wrist = moved == std::ssize(hand_.fingers);
      if (moved == 0 || is_wrist || !(joint.high > joint.low)) continue;
      const int leader = hand_.links[joint.link].leader;
      const int drives = leader < 0 ? joint.link : leader;
      if (driver >= 0 && driver != drives) return {};
      driver = drives;
    }
    if (driver < 0) return {};
    return refuse("the robot is a gripper with one driven joint, " +
                  in_quotes(hand_.links[driver].joint) + ", which moves all its " +
                  std::to_string(hand_.fingers.size()) + " chains of joints" + kNoGripper);
  }

  [[nodiscard]] std::string number_of_fingers() const {
    constexpr std::size_t kShown = 12;
    std::string ends;
    for (std::size_t f = 0; f < std::min(hand_.fingers.size(), kShown); ++f) {
      ends += (f == 0 ? "" : ", ") + hand_.links[hand_.fingers[f].tip].name;
    }
    if (hand_.fingers.size() > kShown) ends += ", ...";
    return "the robot has " + std::to_string(hand_.fingers.size()) +
           (hand_.fingers.size() == 1 ? " chain of joints, which ends in "
                                      : " chains of joints, which end in ") +
           ends +
           "; a hand has a thumb and two to four fingers: of a larger robot let `tips` name the "
           "last links of one hand, thumb first";
  }

  // How far the links from `from` on, and their shapes, are away from its joint.
  [[nodiscard]] double extent_m(int from) const {
    double farthest_m = 0.0;
    for (int l = from; l < std::ssize(hand_.links); ++l) {
      if (!is_above(from, l)) continue;
      const Eigen::Vector3d at_m = placed_.at_m[l] - placed_.at_m[from];
      farthest_m = std::max(farthest_m, at_m.norm());
      for (const Shape& shape : hand_.links[l].shapes) {
        const Hull hull = hull_of_shape(shape);
        for (const auto& corner : hull.corners) {
          farthest_m =
              std::max(farthest_m, (at_m + placed_.turn[l] * corner).norm() + hull.radius_m);
        }
      }
    }
    return farthest_m;
  }

  // The first joints of two chains beyond the last link that carries both, or nothing.
  [[nodiscard]] std::optional<std::pair<int, int>> parted(int one, int other) const {
    const auto first = [&](int last, int beside) {
      int joint = -1;
      for (int l = last; l > 0 && !is_above(l, beside); l = hand_.links[l].parent) {
        if (hand_.links[l].turns) joint = l;
      }
      return joint;
    };
    const std::pair joints(first(one, other), first(other, one));
    if (joints.first < 0 || joints.second < 0) return std::nullopt;
    return joints;
  }

  // Whether each joint from `last` back to `first` holds.
  [[nodiscard]] bool all_joints(int first, int last, const auto& holds) const {
    for (int l = last; l >= first; l = hand_.links[l].parent) {
      if (hand_.links[l].turns && !holds(l)) return false;
    }
    return true;
  }

  // A linkage's rod or a motor's crank ends well before the finger that it moves. All its joints
  // are tied to the finger's by <mimic>, whichever leads; or they turn about the axis of the
  // finger's joint beside which they begin, within the finger's width. Fingers are side by side
  // along their axes, and a thumb's joint is across the palm.
  [[nodiscard]] bool is_rod_of(const Finger& rod, const Finger& finger) const {
    constexpr double kOneAxis = 0.98, kFingerWidth_m = 0.01, kBesides_m = 0.03, kOfFinger = 0.6;
    const auto joints = parted(rod.last, finger.last);
    if (!joints) return false;
    const auto [first, joint] = *joints;
    if (!(extent_m(first) < kOfFinger * extent_m(joint))) return false;
    const auto leader_of = [&](int l) {
      return hand_.links[l].leader < 0 ? l : hand_.links[l].leader;
    };
    const bool tied = all_joints(first, rod.last, [&](int l) {
      return !all_joints(joint, finger.last,
                         [&](int other) { return leader_of(other) != leader_of(l); });
    });
    const Eigen::Vector3d& axis = placed_.axis[joint];
    const auto from_joint = [&](int l) -> Eigen::Vector3d {
      return placed_.at_m[l] - placed_.at_m[joint];
    };
    return tied ||
           (from_joint(first).norm() < kBesides_m && all_joints(first, rod.last, [&](int l) {
              return std::abs(axis.dot(placed_.axis[l])) > kOneAxis &&
                     std::abs(axis.dot(from_joint(l))) < kFingerWidth_m;
            }));
  }

  void leave_out_rods() {
    std::vector<Finger> fingers;
    for (const Finger& one : hand_.fingers) {
      const auto finger = std::ranges::find_if(hand_.fingers, [&](const Finger& other) {
        return other.last != one.last && is_rod_of(one, other);
      });
      if (finger == hand_.fingers.end()) {
        fingers.push_back(one);
        continue;
      }
      hand_.remarks.push_back("link " + in_quotes(hand_.links[one.last].name) +
                              " is taken for a rod beside the finger that ends in " +
                              in_quotes(hand_.links[finger->tip].name) +
                              "; `tips` names the ends of all fingers if it is one");
    }
    hand_.fingers = std::move(fingers);
  }

  // The link at a finger's end: of those fixed to its last one the farthest that is named so, else
  // the farthest.
  [[nodiscard]] int tip_link(int last) const {
    int tip = last;
    bool tip_named = false;
    double far_m = 0.0;
    for (int l = last + 1; l < std::ssize(hand_.links); ++l) {
      if (!is_above(last, l)) continue;
      const double away_m = (placed_.at_m[l] - placed_.at_m[last]).norm();
      const bool named = away_m > kSamePlace_m && lower(hand_.links[l].name).contains("tip");
      if (named < tip_named || (named == tip_named && away_m <= far_m)) continue;
      tip = l;
      tip_named = named;
      far_m = away_m;
    }
    return tip;
  }

  // Where no link is at the finger's end, its shapes end there, in their own direction across the
  // joint: the middle of what is round there. A link that is not named tip is at the end only
  // beyond the half of the shapes.
  void find_end(Finger& finger) const {
    const Eigen::Vector3d& from_m = placed_.at_m[finger.last];
    const double tip_far_m = (placed_.at_m[finger.tip] - from_m).norm();
    finger.tip_known = tip_far_m > kSamePlace_m;
    const bool said = !options_.tips.empty() && finger.tip != finger.last;
    if (said || (finger.tip_known && lower(hand_.links[finger.tip].name).contains("tip"))) return;
    std::vector<std::pair<Eigen::Vector3d, double>> corners;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (int l = finger.last; l < std::ssize(hand_.links); ++l) {
      if (!is_above(finger.last, l)) continue;
      for (const Shape& shape : hand_.links[l].shapes) {
        const Hull hull = hull_of_shape(shape);
        for (const auto& corner : hull.corners) {
          corners.emplace_back(placed_.at_m[l] + placed_.turn[l] * corner - from_m, hull.radius_m);
          middle += corners.back().first;
        }
      }
    }
    if (corners.empty()) return;
    middle /= static_cast<double>(corners.size());
    const Eigen::Vector3d& axis = placed_.axis[finger.last];
    const Eigen::Vector3d aside = middle.dot(axis) * axis;
    const Eigen::Vector3d along = (middle - aside).normalized();
    double end_m = 0.0, radius_m = 0.0;
    for (const auto& [corner, round_m] : corners) {
      const Eigen::Vector3d off = corner - aside;
      end_m = std::max(end_m, off.dot(along) + round_m);
      radius_m = std::max(radius_m, (off - off.dot(along) * along).norm() + round_m);
    }
    if (!(end_m > kSamePlace_m) || (finger.tip_known && tip_far_m > 0.5 * end_m)) return;
    finger.tip = finger.last;
    finger.tip_m = placed_.turn[finger.last].transpose() *
                   (aside + (end_m - std::min(radius_m, 0.5 * end_m)) * along);
    finger.tip_known = true;
  }

  Result<> choose_tips() {
    if (options_.tips.empty()) return {};
    std::vector<Finger> chosen;
    for (const std::string& name : split(options_.tips)) {
      const auto at = std::ranges::find(hand_.links, name, &Link::name);
      const int tip = static_cast<int>(at - hand_.links.begin());
      if (at == hand_.links.end()) {
        return refuse("`tips` names the link " + in_quotes(name) +
                      ", which the URDF does not have");
      }
      const auto finger = std::ranges::find_if(
          hand_.fingers, [&](const Finger& one) { return is_above(one.last, tip); });
      if (finger == hand_.fingers.end()) {
        return refuse("`tips` names the link " + in_quotes(name) + ", which ends no finger");
      }
      chosen.push_back(*finger);
      chosen.back().tip = tip;
    }
    hand_.fingers = std::move(chosen);
    return {};
  }

  // The first link from the palm that turns and carries no other finger.
  [[nodiscard]] int base_of(const Finger& finger) const {
    int base = 0;
    for (int l = finger.last; l > 0; l = hand_.links[l].parent) {
      const bool shared = std::ranges::any_of(hand_.fingers, [&](const Finger& other) {
        return other.last != finger.last && is_above(l, other.last);
      });
      if (shared) break;
      if (hand_.links[l].turns) base = l;
    }
    return base;
  }

  [[nodiscard]] Eigen::Vector3d direction(const Finger& finger) const {
    return (tip_of(finger, placed_) - placed_.at_m[finger.base]).normalized();
  }

  // Which way its tip goes when its joints turn where they can turn further; zero: no way.
  [[nodiscard]] Eigen::Vector3d bend(const Finger& finger) const {
    const Eigen::Vector3d tip_m = tip_of(finger, placed_);
    Eigen::Vector3d way = Eigen::Vector3d::Zero();
    for (int l = finger.tip; l > 0 && is_above(finger.base, l); l = hand_.links[l].parent) {
      const Link& link = hand_.links[l];
      if (!link.turns) continue;
      const double room = link.high + link.low - 2.0 * open_rad_[l];
      way += room * placed_.axis[l].cross(tip_m - placed_.at_m[l]);
    }
    return way.norm() > kBends_m ? way.normalized() : Eigen::Vector3d::Zero();
  }

  // The one finger that bends against all others or across them, which bend one way; else none.
  [[nodiscard]] std::vector<Finger>::iterator facing() {
    constexpr double kOneWay = 0.7, kAcross = 0.5;
    std::vector<Finger>& fingers = hand_.fingers;
    return std::ranges::find_if(fingers, [&](const Finger& thumb) {
      if (bend(thumb).isZero()) return false;  // it bends as far to both sides
      return std::ranges::all_of(fingers, [&](const Finger& one) {
        if (one.last == thumb.last) return true;
        return bend(one).dot(bend(thumb)) < kAcross &&
               std::ranges::all_of(
                   fingers,
                   [&](const Finger& other) {
                     return other.last == thumb.last || bend(one).dot(bend(other)) > kOneWay;
                   });
      });
    });
  }

  // Three fingers that bend to one middle, from about equally far apart.
  [[nodiscard]] bool around_palm() const {
    constexpr double kMostLikely = -0.25;  // cosine; 120 degrees apart: -0.5
    const std::vector<Finger>& fingers = hand_.fingers;
    Eigen::Vector3d along = Eigen::Vector3d::Zero();
    for (const Finger& finger : fingers) along += direction(finger);
    along.normalize();
    const auto inwards = [&](const Finger& finger) {
      const Eigen::Vector3d way = bend(finger);
      return Eigen::Vector3d((way - way.dot(along) * along).normalized());
    };
    return fingers.size() == 3 && std::ranges::all_of(fingers, [&](const Finger& one) {
             return std::ranges::all_of(fingers, [&](const Finger& other) {
               return one.last == other.last || inwards(one).dot(inwards(other)) < kMostLikely;
             });
           });
  }

  // The names of a finger's links and joints.
  [[nodiscard]] std::string names_of(const Finger& finger) const {
    std::string names;
    for (int l = finger.tip; l > 0 && is_above(finger.base, l); l = hand_.links[l].parent) {
      names += lower(" " + hand_.links[l].name + " " + hand_.links[l].joint);
    }
    return names;
  }

  [[nodiscard]] bool is_named_thumb(const Finger& finger) const {
    const std::string names = names_of(finger);
    // "THJ1" is Shadow's; not all that begins so is a thumb: "third".
    return std::ranges::any_of(std::array{"thumb", " thj", "_thj"},
                               [&](const char* word) { return names.contains(word); });
  }

  // The finger's number, 1 for the index finger; 0: unknown. "Middle" tells nothing, because it is
  // the name of a bone in some hands.
  [[nodiscard]] int named_place(const Finger& finger) const {
    constexpr std::array<std::pair<const char*, int>, 5> kWords{
        {{"index", 1}, {"fore", 1}, {"little", 4}, {"pinky", 4}, {"ring", 3}}};
    const std::string names = names_of(finger);
    const auto word =
        std::ranges::find_if(kWords, [&](const auto& one) { return names.contains(one.first); });
    return word == kWords.end() ? 0 : word->second;
  }

  // The thumb has the name, or else points away from the others, or bends against or across them.
  // They are in a row whose end near the thumb is the index finger, unless their names say
  // otherwise.
  Result<> order_fingers() {
    std::vector<Finger>& fingers = hand_.fingers;
    auto thumb = std::ranges::find_if(fingers, [&](const Finger& f) { return is_named_thumb(f); });
    if (thumb == fingers.end()) {
      const auto with_others = [&](const Finger& finger) {
        double sum = -1.0;
        for (const Finger& other : fingers) sum += direction(finger).dot(direction(other));
        return sum / static_cast<double>(fingers.size() - 1);
      };
      thumb = std::ranges::min_element(fingers, {}, with_others);
      const double away = with_others(*thumb);
      const bool alone = std::ranges::count_if(fingers, [&](const Finger& finger) {
                           return with_others(finger) < away + kAlike;
                         }) == 1;
      if (away > kSameWay || !alone) thumb = facing();
      if (thumb == fingers.end() && around_palm()) {
        thumb = fingers.begin();
        hand_.remarks.push_back(
            "its three fingers are alike around the palm: the one that ends in " +
            in_quotes(hand_.links[thumb->tip].name) +
            " is taken for the thumb; `tips` chooses another");
      }
      if (thumb == fingers.end()) {
        return refuse(
            "no finger is named thumb, none points away from the others when open, and none bends "
            "against or across all others; `tips` can name their last links, thumb first");
      }
    }
    std::iter_swap(thumb, fingers.begin());
    const Eigen::Vector3d thumb_m =
        0.5 * (placed_.at_m[fingers[0].base] + tip_of(fingers[0], placed_));
    const auto to_thumb_m = [&](const Finger& f) {
      return (placed_.at_m[f.base] - thumb_m).norm();
    };
    std::ranges::sort(fingers.begin() + 1, fingers.end(), {}, to_thumb_m);
    // The row is straight, so that its order is that along its own line.
    const Eigen::Vector3d row = placed_.at_m[fingers.back().base] - placed_.at_m[fingers[1].base];
    std::sort(fingers.begin() + 1, fingers.end(), [&](const Finger& a, const Finger& b) {
      return placed_.at_m[a.base].dot(row) < placed_.at_m[b.base].dot(row);
    });
    int turned = 0;
    for (std::size_t a = 1; a < fingers.size(); ++a) {
      for (std::size_t b = a + 1; b < fingers.size(); ++b) {
        const int one = named_place(fingers[a]), two = named_place(fingers[b]);
        const bool at_an_end = one == 1 || two == 1 || one == 4 || two == 4;
        if (one == 0 || two == 0) {  // an index or little finger beside one of unknown place
          if (at_an_end) turned += one == 4 || two == 1 ? 1 : -1;
          continue;
        }
        turned += one > two ? 1 : one < two ? -1 : 0;
      }
    }
    if (turned > 0) std::reverse(fingers.begin() + 1, fingers.end());
    hand_.either_side =
        std::abs(to_thumb_m(fingers[1]) - to_thumb_m(fingers.back())) < kSamePlace_m &&
        std::ranges::none_of(fingers, [&](const Finger& f) { return named_place(f) != 0; });
    return {};
  }

  // A joint that moves all fingers is a wrist's, and one that moves none, also not by those that
  // follow it, is none of the hand's.
  Result<> hold_shared() {
    const auto moved_by = [&](int link) {
      return std::ranges::count_if(
          hand_.fingers, [&](const Finger& finger) { return is_above(link, finger.tip); });
    };
    for (int l = 1; l < std::ssize(hand_.links); ++l) {
      const auto moved = moved_by(l);
      if (!hand_.links[l].slides || moved == 0 || moved == std::ssize(hand_.fingers)) continue;
      return refuse("joint " + in_quotes(hand_.links[l].joint) +
                    " of a finger slides, or follows one that does; posed drives joints that turn: "
                    "make it fixed, or let `tips` name other fingers");
    }
    held_.assign(hand_.joints.size(), std::numeric_limits<double>::quiet_NaN());
    const auto is_of_hand = [&](int link) {
      const auto moved = moved_by(link);
      return moved > 0 && moved < std::ssize(hand_.fingers);
    };
    for (std::size_t j = 0; j < hand_.joints.size(); ++j) {
      const RobotJoint& joint = hand_.joints[j];
      const bool leads =
          moved_by(joint.link) == 0 &&
          std::ranges::any_of(hand_.joints, [&](const RobotJoint& other) {
            return hand_.links[other.link].leader == joint.link && is_of_hand(other.link);
          });
      if (is_of_hand(joint.link) || leads) continue;
      held_[j] = std::clamp(0.0, joint.low, joint.high);
      others_.push_back(joint.link);
    }
    return {};
  }

  Result<std::map<int, double>> angles(const std::string& text, const std::string& what) const {
    std::map<int, double> angles;
    const auto read = TRY(parse_named_numbers(text, what, -kMaxNamed_rad, kMaxNamed_rad));
    for (const NamedNumber& one : read) {
      const int joint = find_joint(one.name);
      if (joint < 0) {
        return refuse(what + " = " + in_quotes(one.name) +
                      " is no joint and angle; write \"JOINT=0.5\"");
      }
      const Link& link = hand_.links[hand_.joints[joint].link];
      if (link.leader >= 0) {
        return refuse(what + " names joint " + in_quotes(one.name) + ", which follows joint " +
                      in_quotes(hand_.links[link.leader].joint) + ": name that one");
      }
      const RobotJoint& at = hand_.joints[joint];
      if (!(one.number >= at.low && one.number <= at.high)) {
        return refuse(what + " puts joint " + in_quotes(at.name) + " beyond its limits");
      }
      angles[joint] = one.number;
    }
    return angles;
  }

  Result<> hold_named() {
    const auto held = TRY(angles(options_.hold, "hold"));
    for (const auto& [joint, value] : held) {
      held_[joint] = value;
      std::erase(others_, hand_.joints[joint].link);
    }
    starts_ = TRY(angles(options_.start, "start"));
    for (const auto& [joint, value] : starts_) {
      if (std::isnan(held_[joint])) continue;
      return refuse("start names joint " + in_quotes(hand_.joints[joint].name) +
                    ", which stands: `hold` names its angle");
    }
    return {};
  }

  // Finds the driven joint that moves each joint, and narrows its limits by those of its followers.
  Result<> connect() {
    for (std::size_t j = 0; j < hand_.joints.size(); ++j) {
      RobotJoint& joint = hand_.joints[j];
      if (hand_.links[joint.link].leader >= 0) continue;
      if (!(joint.high > joint.low)) held_[j] = joint.low;
      if (std::isfinite(held_[j])) {
        joint.multiplier = 0.0;
        joint.offset = held_[j];
        continue;
      }
      joint.driven = hand_.size();
      hand_.driven.push_back({.joint = static_cast<int>(j),
                              .low = joint.low,
                              .high = joint.high,
                              .speed = joint.speed,
                              .acceleration = options_.acceleration});
    }
    if (hand_.driven.empty()) {
      return refuse(
          "no joint of the robot's fingers can turn: each stands, or its limits leave it "
          "one angle");
    }
    if (hand_.driven.size() > static_cast<std::size_t>(kMaxDriven)) {
      return refuse("the robot has " + std::to_string(hand_.driven.size()) +
                    " joints to drive; posed drives at most 24: let `tips` name the last links of "
                    "one hand, thumb first, or others stand by `hold`");
    }
    TRY(check_speeds());
    for (RobotJoint& joint : hand_.joints) {
      const Link& link = hand_.links[joint.link];
      if (link.leader < 0) continue;
      const RobotJoint& leader = hand_.joints[hand_.joint_of_link[link.leader]];
      joint.follows = true;
      joint.driven = leader.driven;
      joint.multiplier = link.multiplier;
      joint.offset = link.offset;
      if (leader.driven < 0) {
        joint.offset += link.multiplier * leader.offset;
        joint.multiplier = 0.0;
      }
      TRY(cut_limits(joint));
    }
    for (DrivenJoint& driven : hand_.driven) {
      const auto start = starts_.find(driven.joint);
      driven.start =
          std::clamp(start == starts_.end() ? 0.0 : start->second, driven.low, driven.high);
      const double open_rad = open_rad_[hand_.joints[driven.joint].link];
      driven.open = std::clamp(open_rad, driven.low, driven.high);
    }
    fix_others();
    if (hand_.joints.size() > static_cast<std::size_t>(kMaxRobotJoints)) {
      return refuse("the robot has more than 64 joints that turn: it is no hand");
    }
    fill_turns();
    return {};
  }

  // A joint that is none of the hand's is no value of its commands: where an arm and a hand are one
  // robot, a command for the hand must not send the arm to zero.
  void fix_others() {
    constexpr std::size_t kShown = 8;
    std::vector<RobotJoint> kept;
    std::vector<std::string> names;
    std::size_t others = 0;
    for (std::size_t j = 0; j < hand_.joints.size(); ++j) {
      const RobotJoint& joint = hand_.joints[j];
      if (std::ranges::find(others_, joint.link) == others_.end() || joint.driven >= 0) {
        for (DrivenJoint& driven : hand_.driven) {
          if (driven.joint == static_cast<int>(j)) driven.joint = static_cast<int>(kept.size());
        }
        hand_.joint_of_link[joint.link] = static_cast<int>(kept.size());
        kept.push_back(joint);
        continue;
      }
      Link& link = hand_.links[joint.link];
      link.at.rotate(Eigen::AngleAxisd(joint.offset, link.axis));
      link.turns = false;
      hand_.joint_of_link[joint.link] = -1;
      if (link.leader >= 0) continue;  // it goes with the joint that it follows
      if (++others <= kShown) names.push_back(in_quotes(joint.name));
    }
    hand_.joints = std::move(kept);
    if (others == 0) return;
    hand_.remarks.push_back("no command names " + joined(names) + (others > kShown ? ", ..." : "") +
                            " (which move all fingers or none): they are taken to stand at zero or "
                            "the limit nearest to it, unless `hold` names them and their angles");
  }

  Result<> check_speeds() const {
    for (std::size_t j = 0; options_.needs_speeds && j < hand_.joints.size(); ++j) {
      const RobotJoint& joint = hand_.joints[j];
      if (joint.speed > 0.0 || std::isfinite(held_[j])) continue;
      return refuse("joint " + in_quotes(joint.name) +
                    " has no velocity limit; set speed in [stream.robot]");
    }
    return {};
  }

  Result<> cut_limits(const RobotJoint& joint) {
    const double inside = 1e-7;  // rounding of the follower's angle
    if (joint.driven < 0 || joint.multiplier == 0.0) {
      if (joint.offset >= joint.low && joint.offset <= joint.high) return {};
      if (std::ranges::find(others_, joint.link) != others_.end()) return {};
      return refuse("joint " + in_quotes(joint.name) + " stands beyond its limits");
    }
    DrivenJoint& leader = hand_.driven[joint.driven];
    double low = (joint.low + inside - joint.offset) / joint.multiplier;
    double high = (joint.high - inside - joint.offset) / joint.multiplier;
    if (low > high) std::swap(low, high);
    leader.low = std::max(leader.low, low_float(low));
    leader.high = std::min(leader.high, high_float(high));
    if (leader.low > leader.high) {
      return refuse("joint " + in_quotes(hand_.joints[leader.joint].name) +
                    " has no angle at which joint " + in_quotes(joint.name) +
                    ", which follows it, is within its limits; often the sign of its <mimic> "
                    "multiplier is wrong: mend it as the robot turns");
    }
    const double gain = std::abs(joint.multiplier);
    leader.speed = std::min(leader.speed, joint.speed / gain);
    leader.acceleration = std::min(leader.acceleration, options_.acceleration / gain);
    return {};
  }

  void fill_turns() {
    hand_.turns.resize(hand_.links.size());
    for (int l = 0; l < std::ssize(hand_.links); ++l) {
      for (int above = l; above > 0; above = hand_.links[above].parent) {
        if (!hand_.links[above].turns) continue;
        const RobotJoint& joint = hand_.joints[hand_.joint_of_link[above]];
        if (joint.driven < 0 || joint.multiplier == 0.0) continue;
        hand_.turns[l].push_back(
            {.link = above, .driven = joint.driven, .multiplier = joint.multiplier});
      }
    }
  }

  // All joints at zero, or the limit nearest to it.
  void open_at_zero() {
    for (const Link& link : hand_.links) {
      open_rad_.push_back(std::clamp(0.0, link.low, link.high));
    }
  }

  // Places the links in the open pose before it is known which joints are driven.
  void place_open() {
    for (std::size_t l = 0; l < hand_.links.size(); ++l) {
      const Link& link = hand_.links[l];
      if (link.leader >= 0) {
        open_rad_[l] =
            std::clamp(link.multiplier * open_rad_[link.leader] + link.offset, link.low, link.high);
      }
      Eigen::Isometry3d at = link.at;
      if (link.turns) at = at * Eigen::AngleAxisd(open_rad_[l], link.axis);
      if (link.parent >= 0) {
        at.translation() = placed_.at_m[link.parent] + placed_.turn[link.parent] * at.translation();
        at.linear() = placed_.turn[link.parent] * at.linear();
      }
      placed_.at_m[l] = at.translation();
      placed_.turn[l] = at.linear();
      placed_.axis[l] = at.linear() * link.axis;
    }
  }

  // From its first joint to its tip in the open pose [m].
  double stretch_m(const Finger& finger) {
    place_open();
    return (tip_of(finger, placed_) - placed_.at_m[finger.base]).norm();
  }

  // Turns a finger's joints to where it is longest, and those that change no length, as a
  // knuckle's, to their limit on the side to which the others went.
  void open_fist(const Finger& finger) {
    constexpr int kAngles = 32, kRounds = 2;
    constexpr double kSameAxis = 0.7, kLonger_m = 1e-5;
    Eigen::Vector3d opened = Eigen::Vector3d::Zero();
    const std::vector<double> zero_rad = open_rad_;
    const double before_m = stretch_m(finger);
    const auto axes = placed_.axis;
    for (int round = 0; round < kRounds; ++round) {
      for (int l = finger.last; l > 0 && is_above(finger.base, l); l = hand_.links[l].parent) {
        if (!hand_.links[l].turns) continue;
        const Link& own = hand_.links[l];
        const int leads = own.leader < 0 ? l : own.leader;
        const Link& link = hand_.links[leads];
        const double was_rad = open_rad_[l];
        double best = open_rad_[leads], longest_m = stretch_m(finger) + kLonger_m;
        for (int k = 0; k <= kAngles; ++k) {
          open_rad_[leads] = link.low + (link.high - link.low) * k / kAngles;
          const double found_m = stretch_m(finger);
          if (found_m <= longest_m) continue;
          longest_m = found_m;
          best = open_rad_[leads];
        }
        open_rad_[leads] = best;
        place_open();
        opened += (open_rad_[l] - was_rad) * axes[l];
      }
    }
    if (stretch_m(finger) < before_m + kSamePlace_m) return;
    for (int l = finger.last; l > 0 && is_above(finger.base, l); l = hand_.links[l].parent) {
      const Link& link = hand_.links[l];
      if (!link.turns || link.leader >= 0 || open_rad_[l] != zero_rad[l]) continue;
      const double same = axes[l].dot(opened.normalized());
      if (std::abs(same) >= kSameAxis) open_rad_[l] = same > 0.0 ? link.high : link.low;
    }
    place_open();
  }

  // Where most fingers are bent at zero, zero is a fist: they are opened.
  void open_fists() {
    constexpr double kBent = 0.88;
    const std::vector<double> zero = open_rad_;
    std::size_t bent = 0;
    for (const Finger& finger : hand_.fingers) {
      const double before_m = stretch_m(finger);
      open_fist(finger);
      if (before_m < kBent * stretch_m(finger)) ++bent;
    }
    if (2 * bent <= hand_.fingers.size()) {
      open_rad_ = zero;
      place_open();
      return;
    }
    hand_.remarks.emplace_back(
        "at zero the fingers are bent: palm and side are derived from the fingers where they are "
        "longest, and knuckles as far open as their limits let them; shapes that touch at zero are "
        "not kept apart");
  }

  Drive open_pose() const {
    Drive drive = Drive::Zero();
    for (int i = 0; i < hand_.size(); ++i) {
      drive[i] = hand_.driven[i].open;
    }
    return drive;
  }

  // models/robot/README.md, "Frame".
  Result<> derive_frame() {
    place(hand_, open_pose(), placed_);
    Eigen::Vector3d z = Eigen::Vector3d::Zero();
    for (std::size_t f = 1; f < hand_.fingers.size(); ++f) z += direction(hand_.fingers[f]);
    Eigen::Vector3d y = tip_of(hand_.fingers[1], placed_) - tip_of(hand_.fingers.back(), placed_);
    z.normalize();
    y -= y.dot(z) * z;
    if (!(y.norm() > 1e-3) || !z.allFinite()) {
      return refuse(
          "the robot's fingers are not side by side when open; `tips` names their last "
          "links, thumb first");
    }
    y.normalize();
    for (Finger& finger : hand_.fingers) {
      finger.knuckle = finger.base;
      for (int l = finger.last; finger.human > 0 && l > 0 && is_above(finger.base, l);
           l = hand_.links[l].parent) {
        if (hand_.links[l].turns && std::abs(placed_.axis[l].dot(y)) > 0.8) finger.knuckle = l;
      }
      finger.knuckle_m = placed_.at_m[finger.knuckle];
      finger.length_m = reach_m(finger);
      if (!(finger.length_m > 5e-3)) {
        return refuse("the finger that ends in " + in_quotes(hand_.links[finger.tip].name) +
                      " is shorter than 5 mm; name its last link by `tips`");
      }
      if (finger.length_m > kMaxFinger_m) {
        return refuse(too_long(finger));
      }
    }
    const Eigen::Vector3d out = y.cross(z);  // of a right hand's palm
    double bends = bend_along(out);
    if (bends == 0.0) {  // about as far both ways: the thumb's side decides
      bends = (tip_of(hand_.fingers[0], placed_) - hand_.fingers[1].knuckle_m).dot(out);
    }
    hand_.side = bends >= 0.0 ? Side::kRight : Side::kLeft;
    if (hand_.either_side && hand_.side != options_.side.value_or(Side::kRight) && !turned_round_) {
      turned_round_ = true;
      std::reverse(hand_.fingers.begin() + 1, hand_.fingers.end());
      number_fingers();
      return derive_frame();
    }
    if (options_.side && *options_.side != hand_.side) {
      const bool left = hand_.side == Side::kLeft;
      return refuse(std::string("the URDF is a ") + (left ? "left" : "right") + " hand, and a " +
                    (left ? "right" : "left") +
                    " one drives it; name the other URDF, or `tips` thumb first");
    }
    hand_.palm << (hand_.side == Side::kRight ? out : Eigen::Vector3d(-out)), y, z;
    return {};
  }

  // Says that the finger is too long, and in which units of the file it would not be.
  [[nodiscard]] std::string too_long(const Finger& finger) const {
    constexpr double kMinLength_m = 0.05;
    constexpr std::array<std::pair<const char*, double>, 3> kUnits{
        {{"inches", 0.0254}, {"centimetres", 0.01}, {"millimetres", 1e-3}}};
    std::string units;
    for (const auto& [unit, unit_m] : kUnits) {
      const double length_m = unit_m * finger.length_m;
      if (length_m >= kMinLength_m && length_m <= kMaxFinger_m)
        units += (units.empty() ? "" : " or ") + std::string(unit);
    }
    return "the finger that ends in " + in_quotes(hand_.links[finger.tip].name) + " is " +
           std::to_string(std::lround(100.0 * finger.length_m)) + " cm long" +
           (units.empty() ? ": it is no hand's, or "
                          : ", and a hand's if the file is in " + units +
                                ": a URDF is in metres, so scale its lengths; or ") +
           "`tips` should name another last link";
  }

  // The longest way from knuckle to tip: where links are not in a row, the sum of their lengths is
  // more than a finger can reach. Joint after joint, because each changes it by itself.
  double reach_m(const Finger& finger) {
    constexpr int kAngles = 32, kRounds = 3;
    Drive drive = open_pose();
    const auto length_m = [&] {
      place(hand_, drive, placed_);
      return (tip_of(finger, placed_) - placed_.at_m[finger.knuckle]).norm();
    };
    double longest_m = length_m();
    for (int round = 0; round < kRounds; ++round) {
      for (const Turn& turn : hand_.turns[finger.tip]) {
        if (!is_above(finger.knuckle, turn.link)) continue;
        const DrivenJoint& joint = hand_.driven[turn.driven];
        double best = drive[turn.driven];
        for (int k = 0; k <= kAngles; ++k) {
          drive[turn.driven] = joint.low + (joint.high - joint.low) * k / kAngles;
          const double found_m = length_m();
          if (found_m <= longest_m) continue;
          longest_m = found_m;
          best = drive[turn.driven];
        }
        drive[turn.driven] = best;
      }
    }
    place(hand_, open_pose(), placed_);
    return longest_m;
  }

  // How far the fingers' tips go along `out` when their joints turn where they can turn further;
  // 0: they turn about as far to both sides.
  [[nodiscard]] double bend_along(const Eigen::Vector3d& out) const {
    constexpr double kOneSided = 0.15;
    double sum = 0.0, all = 0.0;
    const Drive open = open_pose();
    for (std::size_t f = 1; f < hand_.fingers.size(); ++f) {
      const Finger& finger = hand_.fingers[f];
      Drive slope = Drive::Zero();
      add_slope(hand_, placed_, finger.tip, tip_of(finger, placed_), out, slope);
      for (int i = 0; i < hand_.size(); ++i) {
        const DrivenJoint& driven = hand_.driven[i];
        sum += slope[i] * (driven.high + driven.low - 2.0 * open[i]);
        all += std::abs(slope[i]) * (driven.high - driven.low);
      }
    }
    return std::abs(sum) < std::max(kBends_m, kOneSided * all) ? 0.0 : sum;
  }

  // The radius of the shape at the finger's end [m]; 0: it has none.
  [[nodiscard]] double tip_radius(const Finger& finger) const {
    double radius_m = 0.0;
    for (int l = finger.tip; l != hand_.links[finger.last].parent; l = hand_.links[l].parent) {
      const Cover& cover = hand_.covers[l];
      for (int c = cover.first; c < cover.first + cover.count; ++c) {
        radius_m = std::max(radius_m, hand_.capsules[c].radius_m);
      }
      if (radius_m > 0.0) return radius_m;
    }
    return 0.0;
  }

  RobotHand hand_;
  RobotOptions options_;
  std::string file_;
  int above_;
  bool turned_round_ = false;  // the row of fingers, for the side
  Placed placed_{static_cast<std::size_t>(kMaxJoints)};
  std::vector<double> open_rad_;  // [link]
  std::vector<double> held_;      // [joint]; NaN: not held
  std::map<int, double> starts_;
  std::vector<int> others_;  // links whose joints are none of the hand's
};

}  // namespace

Drive RobotHand::start() const {
  Drive drive = Drive::Zero();
  for (int i = 0; i < size(); ++i) drive[i] = driven[i].start;
  return drive;
}

// Of several hands the one whose shape says the side, and whose names do not say the other one.
Result<RobotHand> robot_hand(Urdf urdf, const RobotOptions& options, const std::string& file) {
  std::vector<HandBelow> hands;
  const bool small = urdf.links.size() <= static_cast<std::size_t>(kMaxJoints);  // else refused
  if (options.tips.empty() && small) hands = hands_below(urdf.links);
  const Side wanted = options.side.value_or(Side::kRight);
  const bool alone = hands.size() == 1;
  std::vector<HandBelow> fitting;
  std::string palms;
  std::erase_if(hands, [&](const HandBelow& hand) {
    const auto bare = Builder(urdf, {.needs_speeds = false}, file, hand.above).build_bare();
    if (!bare) return true;
    if ((bare->side == wanted || bare->either_side) && hand.named.value_or(wanted) == wanted)
      fitting.push_back(hand);
    palms += (palms.empty() ? "" : ", ") + in_quotes(urdf.links[hand.palm].name);
    return false;
  });
  if (hands.empty()) return Builder(std::move(urdf), options, file).build();
  if (alone) fitting = hands;
  const std::string side = wanted == Side::kLeft ? "left" : "right";
  if (fitting.size() != 1) {
    return misuse("the robot has hands below the links " + palms + ", and " +
                      (fitting.empty() ? "none" : "more than one") + " of them is the " + side +
                      " one by shape and names: let `tips` name the last links of one hand, thumb "
                      "first",
                  file);
  }
  const std::string palm = in_quotes(urdf.links[fitting[0].palm].name);
  auto hand = TRY(Builder(std::move(urdf), options, file, fitting[0].above).build());
  hand.chosen = alone
                    ? "the robot's hand is below link " + palm
                    : "of the robot's hands, below " + palms + ", the " + side + " one is " + palm;
  return hand;
}

// At zero all joints of a posed skeleton have the root's axes, so that a URDF's fixed turns go into
// the offsets and the channels' frames.
Result<Skeleton> robot_skeleton(const RobotHand& hand) {
  Skeleton skeleton;
  skeleton.name = hand.name.empty() ? "robot" : hand.name;
  Eigen::Matrix3d to_posed;  // URDF: x forwards, y left, z up; posed: z forwards, x left, y up
  to_posed << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  std::vector<Eigen::Matrix3d> turn(hand.links.size());
  for (std::size_t l = 0; l < hand.links.size(); ++l) {
    const Link& link = hand.links[l];
    const Eigen::Matrix3d before = link.parent < 0 ? to_posed : turn[link.parent];
    turn[l] = before * link.at.linear();
    Joint joint;
    joint.name = link.parent < 0 ? link.name : link.joint;
    joint.parent = link.parent;
    joint.offset_m =
        link.parent < 0 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(before * link.at.translation());
    if (link.turns) {
      const Eigen::Vector3d axis = turn[l] * link.axis;
      joint.channel_frame = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), axis);
      const RobotJoint& turns = hand.joints[hand.joint_of_link[l]];
      skeleton.channels.push_back({.joint = static_cast<std::uint16_t>(l),
                                   .axis = Axis::kX,
                                   .min = static_cast<float>(turns.low),
                                   .max = static_cast<float>(turns.high),
                                   .follows = turns.follows});
    }
    skeleton.joints.push_back(std::move(joint));
  }
  // The root's link may have a joint's name.
  while (std::ranges::count(skeleton.joints, skeleton.joints[0].name, &Joint::name) > 1) {
    skeleton.joints[0].name += " root";
  }
  for (const Capsule& capsule : hand.capsules) {
    skeleton.capsules.push_back({.joint = static_cast<std::uint16_t>(capsule.link),
                                 .from_m = turn[capsule.link] * capsule.from_m,
                                 .to_m = turn[capsule.link] * capsule.to_m,
                                 .radius_m = capsule.radius_m});
  }
  TRY(skeleton.finish());
  return skeleton;
}

}  // namespace posed::robot

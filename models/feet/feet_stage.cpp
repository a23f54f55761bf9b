#include "models/feet/feet_stage.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "models/elapsed.hpp"
#include "models/feet/contacts.hpp"
#include "models/feet/leg_reach.hpp"
#include "models/feet/legs.hpp"
#include "models/feet/smoothing.hpp"
#include "models/parameter_table.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::feet {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kUnknownRate_hz = 60.0;
constexpr double kMaxStep_s = 0.1;      // a frame of the slowest stream
constexpr double kMinStep = 0.5;        // of the nominal one: frames that arrive together are not
constexpr double kGap_s = 0.25;         // after a longer silence the feet have gone on unseen
constexpr double kMaxSpeed_m_s = 12.0;  // no person runs faster
constexpr double kJump = 0.3;           // of a leg's length: what tracking may be off by in a frame
constexpr double kChangeTau_s = 0.3;
constexpr double kSink_m = 0.005;     // a foot may sink by so much
constexpr double kNoChange_m = 0.01;  // a style that moves feet by less is fading out or gone

Eigen::Vector3d vector_of(const Vec3f& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

RT_SAFE void move_root(const Eigen::Vector3d& root_m, const Eigen::Vector3d& offset_m,
                       Frame& frame) noexcept {
  if (offset_m.isZero(0.0)) return;  // every bit stays
  const Eigen::Vector3d moved_m = root_m + offset_m;
  for (int i = 0; i < 3; ++i) {
    frame.root_position_m[i] = static_cast<float>(moved_m[i]);
  }
}

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

// How far a foot of the avatar must be from where the style put it so that it stands: it moves and
// turns as the performer's does while that stands, and goes back to the style while it swings
// (models/feet/README.md, "Hold"). Causal. One thread.
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

constexpr double kSwingTau_s = 0.08;  // how fast a swinging foot goes back to the style
constexpr double kCreep_m_s = 0.01;   // a foot that stands for long goes back by this
constexpr double kGoneTau_s = 0.3;
constexpr double kGone_m_s = 0.1;
constexpr double kGain = 2.0;  // of the weight of a contact, up to 1
constexpr double kHeld = 0.5;  // from this on the foot stands

// Moves and turns the foot as the performer's.
RT_SAFE void FootHold::stand(const FootPair& pair, const std::array<PointContact, kPoints>& contact,
                             double hold) noexcept {
  const FootPair::Foot& performer = pair.performer;
  const FootPair::Foot& avatar = pair.avatar;
  const Quaterniond old_turn(rotation_exp(change_.turn_rad));
  const Quaterniond wanted = performer.rotation * before_.performer.rotation.conjugate() *
                             old_turn * before_.avatar.rotation * avatar.rotation.conjugate();
  const Vector3d turn_rad = rotation_log(wanted);
  change_.turn_rad += hold * (turn_rad - change_.turn_rad);
  const Quaterniond turn(rotation_exp(change_.turn_rad));
  Vector3d wanted_m = Vector3d::Zero();
  double weight = 0.0;
  for (const std::size_t p : {kAnkle, kToe}) {
    const double w = contact[p].weight;
    if (w <= 0.0) continue;
    const Vector3d& ankle_m = avatar.point_m[kAnkle];
    const Vector3d& old_ankle_m = before_.avatar.point_m[kAnkle];
    const Vector3d now_m = ankle_m + turn * (avatar.point_m[p] - ankle_m);
    const Vector3d old_m = old_ankle_m + old_turn * (before_.avatar.point_m[p] - old_ankle_m);
    const Vector3d performed_m = performer.point_m[p] - before_.performer.point_m[p];
    wanted_m += w * (performed_m - (now_m - old_m));
    weight += w;
  }
  if (weight > 0.0) change_.ankle_m += hold * wanted_m / weight;
}

RT_SAFE const FootHold::Change& FootHold::update(const FootPair& pair,
                                                 const std::array<PointContact, kPoints>& contact,
                                                 const HoldOptions& options, double gone,
                                                 double dt_s) noexcept {
  assert(dt_s > 0.0);
  const double most = std::max(contact[kAnkle].weight, contact[kToe].weight);
  const double hold = options.share * std::min(1.0, kGain * most) * (1.0 - gone);
  const bool held = hold >= kHeld * options.share;
  if (held && !held_) begun_ = change_;
  if (started_ && hold > 0.0) stand(pair, contact, hold);
  if (held_ && !held) {
    const double half = options.ahead ? 0.5 : 0.0;
    home_.ankle_m = half * (begun_.ankle_m - change_.ankle_m);
    home_.turn_rad = half * (begun_.turn_rad - change_.turn_rad);
  }
  const double swing = smoothing((1.0 - hold) * dt_s, kSwingTau_s) * (1.0 - gone);
  change_.ankle_m += swing * (home_.ankle_m - change_.ankle_m);
  change_.turn_rad += swing * (home_.turn_rad - change_.turn_rad);
  const double creep_m = (hold * kCreep_m_s + gone * kGone_m_s) * dt_s;
  change_.ankle_m = approached(change_.ankle_m, gone * dt_s / kGoneTau_s, creep_m);
  change_.turn_rad = approached(change_.turn_rad, gone * dt_s / kGoneTau_s, creep_m);
  before_ = pair;
  started_ = true;
  held_ = held;
  return change_;
}

// A root that strides leaves little to hold; all of it would cost style.
HoldOptions hold_of(RootMode mode) {
  return mode == RootMode::kActor ? HoldOptions{.share = 1.0, .ahead = true}
                                  : HoldOptions{.share = 0.86, .ahead = false};
}

struct FeetOptions {
  RootOptions root;
};

class FeetStage final : public Stage {
 public:
  using Table = ParameterTable<FeetOptions, FeetStage>;
  static const Table& table();

  // `rate_hz`: nominal, for frames without times; 0: unknown.
  FeetStage(std::shared_ptr<const Skeleton> skeleton, Legs legs, double rate_hz,
            const FeetOptions& options) noexcept;

  // Emits one frame for each frame in. Frames of another skeleton, and frames whose unstyled
  // original is not known, pass through.
  RT_SAFE void process(const StageFrame& in, StageOut& out) noexcept override;
  void set(std::size_t parameter, double value) noexcept override {
    table_.set(*this, options_, parameter, value);
  }
  [[nodiscard]] ParameterState state(std::size_t parameter) const noexcept override {
    return table_.state(*this, options_, parameter);
  }

 private:
  [[nodiscard]] bool serves(const StageFrame& in) const noexcept;
  [[nodiscard]] double step_s(const Frame& frame, const Eigen::Vector3d& root_m) noexcept;
  [[nodiscard]] double gone(double dt_s) noexcept;
  void restart() noexcept;
  void forget() noexcept;
  [[nodiscard]] double lowest_sole_m(const Eigen::Vector3d& root_m) const noexcept;
  void hold(std::size_t leg, const Eigen::Vector3d& root_m, const Eigen::Vector3d& offset_m,
            bool learnt, double gone, double dt_s, Frame& frame) noexcept;

  const Table& table_ = table();
  std::shared_ptr<const Skeleton> skeleton_;
  Legs legs_;
  double nominal_s_;
  double least_s_;  // 0 where the rate is not known
  FeetOptions options_;
  Elapsed elapsed_;
  LegPose performer_, avatar_;
  Contacts contacts_;
  RootMotion root_;
  std::array<FootHold, kLegs> holds_{};
  Eigen::Vector3d last_root_m_ = Eigen::Vector3d::Zero();
  bool seen_ = false;      // last_root_m_ is of the frame before
  double change_m_ = 0.0;  // how far the style moves a foot, with a slow fall
};

const FeetStage::Table& FeetStage::table() {
  static const Table table({
      Table::row<[](auto& options) -> auto& { return options.root.mode; }>(
          {.name = "root",
           .help = "stride: it walks as far as its own legs do; actor: it stays on the performer,"
                   " and its legs reach for the ground; off: feet slide",
           .live = true,
           .words = kRootModes}),
      Table::row<[](auto& options) -> auto& { return options.root.limit_m; }>(
          {.name = "limit_m",
           .help = "actor: how far the root may be from the performer's",
           .min = 0.0,
           .max = 0.5,
           .live = true,
           .display_name = "limit_cm",
           .display_scale = 100.0}),
  });
  return table;
}

FeetStage::FeetStage(std::shared_ptr<const Skeleton> skeleton, Legs legs, double rate_hz,
                     const FeetOptions& options) noexcept
    : skeleton_(std::move(skeleton)),
      legs_(std::move(legs)),
      nominal_s_(1.0 / (rate_hz > 0.0 ? rate_hz : kUnknownRate_hz)),
      least_s_(rate_hz > 0.0 ? kMinStep / rate_hz : 0.0),
      options_(options),
      contacts_(legs_),
      root_(legs_) {}

RT_SAFE bool FeetStage::serves(const StageFrame& in) const noexcept {
  return in.input != nullptr && in.frame.skeleton == skeleton_->id &&
         in.input->skeleton == skeleton_->id;
}

// The time since the last frame [s]. A performer who has gone unseen for a while, or who is
// somewhere else all at once, begins anew.
RT_SAFE double FeetStage::step_s(const Frame& frame, const Eigen::Vector3d& root_m) noexcept {
  const double gap_s = elapsed_.next_s(frame.header);
  const double dt_s = gap_s > 0.0 ? std::min(std::max(gap_s, least_s_), kMaxStep_s) : nominal_s_;
  const double moved_m = (root_m - last_root_m_).norm();
  const double fastest_m = kMaxSpeed_m_s * std::max(gap_s, dt_s);
  const bool teleports = seen_ && moved_m > kJump * legs_.length_m() + fastest_m;
  if (teleports) {
    root_.forget();
    holds_ = {};
  }
  if (teleports || gap_s > kGap_s) restart();
  last_root_m_ = root_m;
  seen_ = true;
  return dt_s;
}

// 0 while the style moves the feet, 1 where it does not. Who rests on both feet is not known to
// walk on without the style, and his avatar does not glide back: that waits for his next steps.
RT_SAFE double FeetStage::gone(double dt_s) noexcept {
  const bool strides = options_.root.mode == RootMode::kStride;
  const double moves = strides ? 1.0 - contacts_.both_stand() : 1.0;
  change_m_ *= std::exp(-moves * dt_s / kChangeTau_s);
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    if (!performer_.measured[leg] || !avatar_.measured[leg]) continue;
    for (std::size_t p = 0; p < kPoints; ++p) {
      if (!legs_.leg(leg).has(p)) continue;
      const Eigen::Vector3d change_m =
          avatar_.point_from_root_m[leg][p] - performer_.point_from_root_m[leg][p];
      change_m_ = std::max(change_m_, change_m.norm());
    }
  }
  return moves * std::clamp(1.0 - change_m_ / kNoChange_m, 0.0, 1.0);
}

RT_SAFE void FeetStage::restart() noexcept {
  contacts_.restart();
  root_.restart();
  for (FootHold& hold : holds_) hold.restart();
}

RT_SAFE void FeetStage::forget() noexcept {
  seen_ = false;
  root_.forget();
  contacts_.forget();
  holds_ = {};
}

// How high the lowest point of the performer's feet is above where such a point stands.
RT_SAFE double FeetStage::lowest_sole_m(const Eigen::Vector3d& root_m) const noexcept {
  double lowest_m = std::numeric_limits<double>::infinity();
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    if (!performer_.measured[leg]) continue;
    for (std::size_t p = 0; p < kPoints; ++p) {
      if (!legs_.leg(leg).has(p)) continue;
      const double height_m = root_m.y() + performer_.point_from_root_m[leg][p].y();
      lowest_m = std::min(lowest_m, height_m - contacts_.ground_m(p));
    }
  }
  return lowest_m;
}

// Bends a leg so that its foot stands. `root_m` is the performer's; above the ground a style whose
// height is `learnt` may keep its feet lower than his.
RT_SAFE void FeetStage::hold(std::size_t leg, const Eigen::Vector3d& root_m,
                             const Eigen::Vector3d& offset_m, bool learnt, double gone, double dt_s,
                             Frame& frame) noexcept {
  const Leg& bones = legs_.leg(leg);
  FootHold& hold = holds_[leg];
  if (!performer_.measured[leg] || !avatar_.measured[leg]) return hold.restart();
  const auto foot = static_cast<std::size_t>(bones.foot);
  FootPair pair{.performer = {.rotation = performer_.world_rotation[foot]},
                .avatar = {.rotation = avatar_.world_rotation[foot]}};
  std::array<PointContact, kPoints> contact{};
  for (std::size_t p = 0; p < kPoints; ++p) {
    if (!bones.has(p)) continue;
    pair.performer.point_m[p] = root_m + performer_.point_from_root_m[leg][p];
    pair.avatar.point_m[p] = root_m + offset_m + avatar_.point_from_root_m[leg][p];
    contact[p] = contacts_.point(leg, p);
  }
  const FootHold::Change change =
      hold.update(pair, contact, hold_of(options_.root.mode), gone, dt_s);
  const Eigen::Quaterniond turn(rotation_exp(change.turn_rad));
  const std::array<Eigen::Vector3d, kPoints>& avatar_m = pair.avatar.point_m;
  const double lowest_m = lowest_sole_m(root_m);
  const double floor_m = (learnt ? std::min(lowest_m, 0.0) : lowest_m) - kSink_m;
  double sunk_m = 0.0;
  for (std::size_t p = 0; p < kPoints; ++p) {
    if (!bones.has(p)) continue;
    const Eigen::Vector3d at_m =
        avatar_m[kAnkle] + change.ankle_m + turn * (avatar_m[p] - avatar_m[kAnkle]);
    sunk_m = std::max(sunk_m, floor_m - (at_m.y() - contacts_.ground_m(p)));
  }
  sunk_m *= 1.0 - gone;
  if (change.none() && sunk_m < FootHold::Change::kNone) return;
  const Eigen::Vector3d& ankle_m = avatar_.point_from_root_m[leg][kAnkle];
  const Reach bent = reach(*skeleton_, bones, avatar_,
                           ankle_m + change.ankle_m + sunk_m * Eigen::Vector3d::UnitY());
  hold.reached(bent.ankle_m - ankle_m);
  write_leg(*skeleton_, bones, avatar_, bent, turn * avatar_.world_rotation[foot], frame);
}

RT_SAFE void FeetStage::process(const StageFrame& in, StageOut& out) noexcept {
  const Eigen::Vector3d root_m = vector_of(in.frame.root_position_m);
  if (!serves(in)) {
    forget();
    return out.frame(in);
  }
  // Without a root nothing is known of the feet, but the avatar stays where it was.
  const bool rooted = in.frame.valid[skeleton_->root_joint];
  if (!rooted || !root_m.allFinite()) {
    restart();
    Frame frame = in.frame;
    move_root(root_m, root_.offset_m(), frame);
    return out.frame({.frame = frame, .variance_rad2 = in.variance_rad2, .input = in.input});
  }
  legs_.pose(*in.input, performer_);
  legs_.pose(in.frame, avatar_);
  const double dt_s = step_s(in.frame, root_m);
  contacts_.update(performer_, root_m, dt_s);
  const double gone_now = gone(dt_s);
  const PosePair pair{
      .performer = performer_, .avatar = avatar_, .root_m = root_m, .learnt = in.root};
  const Eigen::Vector3d offset_m = root_.update(pair, contacts_, gone_now, dt_s, options_.root);
  Frame frame = in.frame;
  move_root(root_m, offset_m, frame);
  const double released = options_.root.mode == RootMode::kOff ? 1.0 : gone_now;
  for (std::size_t leg = 0; leg < kLegs; ++leg) {
    hold(leg, root_m, offset_m, in.root != nullptr, released, dt_s, frame);
  }
  out.frame({.frame = frame, .variance_rad2 = in.variance_rad2, .input = in.input});
}

Result<std::unique_ptr<Stage>> make_stage(std::shared_ptr<const Skeleton> skeleton, double rate_hz,
                                          const FeetOptions& options) {
  auto legs = TRY(Legs::find(*skeleton));
  return std::make_unique<FeetStage>(std::move(skeleton), std::move(legs), rate_hz, options);
}

}  // namespace

const StageType& feet_type() {
  static const StageType type{.name = "feet",
                              .summary = "makes the feet of a styled body stand",
                              .words = "feet stand",
                              .parameters = FeetStage::table().specs(),
                              .needs_input = true,
                              .make = [](const StageContext& context, const StageModel* /*model*/) {
                                return make_stage(context.skeleton, context.rate_hz,
                                                  FeetStage::table().options(context.parameters));
                              }};
  return type;
}

Result<std::unique_ptr<Stage>> make_feet_stage(std::shared_ptr<const Skeleton> skeleton,
                                               double rate_hz, const RootOptions& root) {
  return make_stage(std::move(skeleton), rate_hz, {.root = root});
}

}  // namespace posed::feet
